#!/usr/bin/env python3
"""Renders with two builds of the command-line tool and compares bit by bit.

    compare_builds.py OLD NEW

OLD and NEW are the two programs `promenade`. Rendered are five seconds of `data/speech.wav` through each scene of `presets/scenes`, and
one of `presets/library`, in each tier that it has, along `presets/paths/walk.json` and along a small circle with turns in all three angles. Prints one line for each
rendering: "same", or the number of samples that differ, the largest difference in dB full scale, and where it is.
Exit status 1 if any rendering differs, or if only one of the builds makes it. Needs numpy and soundfile.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf

ROOT = Path(__file__).resolve().parents[2]
TIERS = ["draft", "standard", "high", "reference", "clip"]
CIRCLE = [
    {"t": 0, "position": [0, 0, 0], "ypr": [0, 0, 0]},
    {"t": 1, "position": [0.8, 0.6, 0.1], "ypr": [90, 10, 0]},
    {"t": 2, "position": [1.5, -0.4, 0], "ypr": [179, -10, 5]},
    {"t": 3.5, "position": [0.2, -0.9, 0], "ypr": [-90, 0, 0]},
    {"t": 5, "position": [0, 0, 0], "ypr": [0, 0, 0]},
]


def render(program, scene, tier, path, folder):
    """The samples and their rate, or None where the scene has no such tier."""
    out = folder / "out.wav"
    command = [program, "render", scene, folder / "dry.wav", out, "--tier", tier, "--path", path, "--bits", "32f"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        # What builds of different ages say of a tier that the scene lacks.
        if any(text in done.stderr for text in ["tier: expected", "expected a scene with", "expected one with an anchor cloud", "trained for streams"]):
            return None
        sys.exit(f"{program}: {scene.name}, {tier}, {path.name}: {done.stderr.strip()}")
    return sf.read(out, dtype="float32", always_2d=True)


def verdict(old, new):
    if old is None or new is None:
        return f"only the {'new' if old is None else 'old'} build renders it"
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
            rendered = 0
            for tier in TIERS:
                for path in [ROOT / "presets/paths/walk.json", circle]:
                    old, new = (render(program, scene, tier, path, folder) for program in builds)
                    if old is None and new is None:
                        continue
                    rendered += 1
                    result = verdict(old, new)
                    worse += result != "same"
                    print(f"{scene.stem} {tier} {path.stem}: {result}", flush=True)
            if rendered == 0:
                sys.exit(f"{scene.name} has none of the tiers {', '.join(TIERS)}")
    if worse:
        sys.exit(f"{worse} renderings differ")


if __name__ == "__main__":
    main()
