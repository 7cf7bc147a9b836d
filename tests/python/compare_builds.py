#!/usr/bin/env python3
"""Renders with two builds of the command-line tool and compares bit by bit.

    compare_builds.py OLD NEW

OLD and NEW are the two programs `promenade`. Rendered are five seconds of `data/speech.wav` through each scene of `presets/scenes`, and
one of `presets/library`, along `presets/paths/walk.json` and along a small circle with turns in all three angles. Prints one line for each
rendering: "same", or the number of samples that differ, the largest difference in dB full scale, and where it is.
Exit status 1 if any rendering differs. Needs numpy and soundfile.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf

ROOT = Path(__file__).resolve().parents[2]
CIRCLE = [
    {"t": 0, "position": [0, 0, 0], "ypr": [0, 0, 0]},
    {"t": 1, "position": [0.8, 0.6, 0.1], "ypr": [90, 10, 0]},
    {"t": 2, "position": [1.5, -0.4, 0], "ypr": [179, -10, 5]},
    {"t": 3.5, "position": [0.2, -0.9, 0], "ypr": [-90, 0, 0]},
    {"t": 5, "position": [0, 0, 0], "ypr": [0, 0, 0]},
]


def render(program, scene, path, folder):
    """The samples and their rate."""
    out = folder / "out.wav"
    command = [program, "render", scene, folder / "dry.wav", out, "--path", path, "--bits", "32f"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{program}: {scene.name}, {path.name}: {done.stderr.strip()}")
    return sf.read(out, dtype="float32", always_2d=True)


def verdict(old, new):
    (a, rate), (b, rate_of_b) = old, new
    if rate != rate_of_b or a.shape != b.shape:
        return f"{a.shape} samples at {rate} Hz became {b.shape} at {rate_of_b} Hz"
    differ = a.view(np.uint32) != b.view(np.uint32)
    if not differ.any():
        return "same"
    apart = np.abs(a.astype(np.float64) - b)
    frame, channel = np.unravel_index(np.argmax(apart), apart.shape)
    level = 20 * np.log10(max(apart[frame, channel], 1e-30))
    ear = ["left", "right"][channel]
    return f"{differ.sum()} of {differ.size} samples differ, at most {level:.1f} dB, {ear} at {frame / rate:.4f} s"


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    builds = [Path(program).resolve() for program in sys.argv[1:]]
    worse = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        dry, rate = sf.read(ROOT / "data/speech.wav", dtype="int16")
        sf.write(folder / "dry.wav", dry[rate : 6 * rate], rate)
        circle = folder / "circle.json"
        circle.write_text(json.dumps(CIRCLE))
        for scene in [*sorted((ROOT / "presets/scenes").glob("*.promenade")), ROOT / "presets/library/living-room.promenade"]:
            for path in [ROOT / "presets/paths/walk.json", circle]:
                result = verdict(*(render(program, scene, path, folder) for program in builds))
                worse += result != "same"
                print(f"{scene.stem} {path.stem}: {result}", flush=True)
    if worse:
        sys.exit(f"{worse} renderings differ")


if __name__ == "__main__":
    main()
