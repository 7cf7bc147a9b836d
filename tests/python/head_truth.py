#!/usr/bin/env python3
"""Compares a scene heard with another head with the room simulated with that head.

    head_truth.py PROMENADE MEASURED.sofa OTHER.sofa

PROMENADE is the program. A box of 6 x 4.5 x 3 m with a source 1.5 m from the listener is simulated at 48 kHz with the first head at 36
turns and baked, with and without `--head MEASURED.sofa`. An impulse is rendered at 12 turns, half of them between those of the bake, by
the scene as it is and with `--head OTHER.sofa`. The same 12 are simulated with the other head. Of each the direct sound, from 1 ms before
the onset for 4.5 ms, is measured by `promenade measure --response`. Prints the errors of ITD (us) and broadband ILD (dB): largest and mean
magnitude, then all of them. Needs numpy and soundfile.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf

RATE = 48_000
EMITTER, LISTENER = [4.0, 2.2, 1.5], [2.5, 2.2, 1.5]
BAKED, HEARD = range(-180, 180, 10), range(-165, 180, 30)


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return done.stdout


def simulated(program, head, turns, folder):
    """Both ears' responses, by turn, and the folder that they are in."""
    walk = folder / "walk.json"
    walk.write_text(json.dumps([{"t": i, "position": LISTENER, "ypr": [yaw, 0, 0]} for i, yaw in enumerate(turns)]))
    out = folder / f"{head.stem}-{len(turns)}"
    place = ",".join(map(str, EMITTER))
    run(program, "simulate", "box", "--size", "6,4.5,3", "--emitter", place, "--absorption", 0.25, "--head", head,
        "--path", walk, "--order", 4, "--length", 0.5, "--rate", RATE, "-o", out)
    files = json.loads((out / "responses.json").read_text())["responses"]
    return out, {yaw: sf.read(out / entry["file"])[0] for yaw, entry in zip(turns, files)}


def direct_figures(program, ears, folder):
    """ITD in us and ILD in dB of the direct sound."""
    onset = min(np.argmax(np.abs(ear) > 0.2 * np.abs(ear).max()) for ear in ears.T)
    start = max(onset - RATE // 1000, 0)
    piece = ears[start : start + int(0.0045 * RATE)].copy()
    fade = RATE // 2000
    piece[-fade:] *= np.cos(np.linspace(0, np.pi / 2, fade))[:, None] ** 2
    file = folder / "direct.wav"
    sf.write(file, piece, RATE, subtype="FLOAT")
    figures = json.loads(run(program, "measure", "--response", file))["response"]
    return np.array([figures["itd_us"], figures["ild_db"]])


def main():
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    program, measured, other = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        baked_from, _ = simulated(program, measured, BAKED, folder)
        _, truth = simulated(program, other, HEARD, folder)
        wanted = {yaw: direct_figures(program, ears, folder) for yaw, ears in truth.items()}
        impulse = np.zeros(int(0.6 * RATE), np.float32)
        impulse[RATE // 50] = 0.5
        dry, out, scene = folder / "dry.wav", folder / "out.wav", folder / "scene.promenade"
        sf.write(dry, impulse, RATE, subtype="FLOAT")
        for known in [[], ["--head", measured]]:
            run(program, "bake", "responses", baked_from, "-o", scene, *known)
            for heard in [[], ["--head", other]]:
                errors = []
                for yaw in HEARD:
                    pose = ",".join(map(str, [*LISTENER, yaw, 0, 0]))
                    run(program, "render", scene, dry, out, "--pose", pose, "--bits", "32f", *heard)
                    errors.append(direct_figures(program, sf.read(out)[0], folder) - wanted[yaw])
                errors = np.array(errors)
                most, mean = np.abs(errors).max(axis=0), np.abs(errors).mean(axis=0)
                print(f"measured head {'known' if known else 'unknown'}, {'other' if heard else 'own'} head heard: "
                      f"ITD {most[0]:.1f} us at most, mean {mean[0]:.1f}; ILD {most[1]:.2f} dB at most, mean {mean[1]:.2f}")
                print("  ITD", " ".join(f"{e:.0f}" for e in errors[:, 0]), "  ILD", " ".join(f"{e:.2f}" for e in errors[:, 1]))


if __name__ == "__main__":
    main()
