#!/usr/bin/env python3
"""Compares scenes' answers to a click with the responses of a room, at a capture's test poses or at all.

Usage: scene_responses.py ROOM [CAPTURE] SCENE...

ROOM is a folder of `promenade simulate box`, CAPTURE what `promenade capture from-responses` made of it. With CAPTURE every fourth of its test poses is compared, without it every response of ROOM. Needs `promenade` on the PATH and nothing
besides Python. Prints, per scene, the means of T20, EDT, C50, ILD and ITD of what was rendered and their mean absolute errors, the median and the
largest in brackets; definitions are those of `promenade measure --response`.
"""
import json
import statistics
import struct
import subprocess
import sys
import tempfile
import wave
from pathlib import Path

FIGURES = ["t20_s", "edt_s", "c50_db", "ild_db", "itd_us"]
# Every so many test poses are compared.
EVERY = 4


def figures(path):
    out = subprocess.run(["promenade", "measure", "--response", str(path)], capture_output=True, text=True, check=True)
    found = json.loads(out.stdout)
    return found.get("response", found)


def rate_hz(path):
    """Of a WAV file of floats, which Python's own reader does not know."""
    header = path.read_bytes()[:4096]
    return struct.unpack_from("<I", header, header.index(b"fmt ") + 12)[0]


def main(room, capture, scenes):
    responses = json.loads((room / "responses.json").read_text())["responses"]
    poses = responses
    if capture:
        manifest = json.loads((capture / "capture.json").read_text())
        tests = {clip["track"] for clip in manifest["clips"] if clip["split"] == "test"}
        poses = [r for r in responses if Path(r["file"]).stem in tests][::EVERY]
    rate = rate_hz(room / poses[0]["file"])
    with tempfile.TemporaryDirectory() as folder:
        click, heard = Path(folder) / "click.wav", Path(folder) / "heard.wav"
        with wave.open(str(click), "wb") as out:
            out.setparams((1, 2, rate, 0, "NONE", ""))
            samples = [0] * rate
            samples[rate // 11] = 16384
            out.writeframes(struct.pack(f"<{rate}h", *samples))
        truth = [figures(room / r["file"]) for r in poses]
        print(f"| {len(poses)} poses | " + " | ".join(FIGURES) + " |\n|---|" + "---:|" * len(FIGURES))
        print("| responses | " + " | ".join(f"{statistics.mean(t[f] for t in truth):.3f}" for f in FIGURES) + " |")
        for scene in scenes:
            found = []
            for r in poses:
                listener = r["listener"]
                pose = ",".join(str(v) for v in listener["position"] + listener["ypr"])
                subprocess.run(["promenade", "render", scene, click, heard, "--pose", pose], capture_output=True, check=True)
                found.append(figures(heard))
            cells = []
            for f in FIGURES:
                errors = [abs(a[f] - t[f]) for a, t in zip(found, truth)]
                off = f"{statistics.mean(errors):.3f} [{statistics.median(errors):.3f}, {max(errors):.3f}]"
                cells.append(f"{statistics.mean(a[f] for a in found):.3f} (off by {off})")
            print(f"| {scene} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with_capture = not sys.argv[2].endswith(".promenade")
    main(Path(sys.argv[1]), Path(sys.argv[2]) if with_capture else None, sys.argv[2 + with_capture :])
