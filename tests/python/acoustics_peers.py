#!/usr/bin/env python3
"""The shoebox example of acoustic-spaces (8 x 6 x 3 m) here and there: processor time and room parameters side by side.

    acoustics_peers.py PROMENADE [--rays 50000] [--seconds 2.5]

PROMENADE is the program. Both trace as many rays from the same mesh with the same materials, on one thread; acoustic-spaces a set for each of
eight bands, here seven octaves share one. There is no head here: the listener is a single point, a set of one response of one sample.
T30, EDT and C80 of the octaves from 125 Hz to 8 kHz are measured by the same lines of this file on both responses. Not quite the same
work: acoustic-spaces writes four formats, here images go to order 6 instead of 3. Skips, with status 0, where acoustic-spaces is not
installed. Needs numpy, scipy and soundfile.
"""
import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from importlib import util
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

OCTAVES = [125, 250, 500, 1000, 2000, 4000, 8000]
RATE = 48_000


def run(*command):
    """Processor seconds of a command on one thread."""
    one = {name: "1" for name in ["RAYON_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"]}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, env=os.environ | one)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def decay_s(energy, upper, lower, rate):
    left = np.cumsum(energy[::-1])[::-1]
    left = 10 * np.log10(left / left[0] + 1e-15)
    piece = (left <= upper) & (left >= lower)
    return -60 / np.polyfit(np.flatnonzero(piece) / rate, left[piece], 1)[0]


def parameters(response, rate):
    """T30 and EDT in seconds and C80 in dB by octave, from the direct sound on."""
    response = response[np.argmax(np.abs(response) > 0.1 * np.abs(response).max()) :]
    rows = []
    for hz in OCTAVES:
        edges = [hz / np.sqrt(2), min(hz * np.sqrt(2), 0.49 * rate)]
        energy = signal.sosfilt(signal.butter(4, edges, "band", fs=rate, output="sos"), response) ** 2
        early = int(0.08 * rate)
        clarity = 10 * np.log10(energy[:early].sum() / energy[early:].sum())
        rows.append((decay_s(energy, -5, -35, rate), decay_s(energy, 0, -10, rate), clarity))
    return np.array(rows)


def theirs(example, folder, args):
    out = folder / "theirs"
    command = Path(sys.executable).parent / "acoustic-spaces"
    seconds = run(command, "simulate", example / "scene.yaml", "--out", out, "--rays", args.rays, "--length", args.seconds,
                  "--sample-rate", RATE, "--threads", 1, "--seed", 1)
    [response] = [path for path in out.glob("*.wav") if "." not in path.stem]
    return seconds, *sf.read(response)


def ours(example, folder, args):
    ears = folder / "point"
    ears.mkdir()
    pulse = np.zeros((256, 2), np.float32)
    pulse[64] = 1
    sf.write(ears / "pulse.wav", pulse, RATE, subtype="FLOAT")
    entry = {"file": "pulse.wav", "azimuth_deg": 0, "distance_m": 1}
    (ears / "responses.json").write_text(json.dumps({"title": "point", "responses": [entry]}))
    materials = "walls=smooth_brickwork_flush_pointing:0.05,floor=carpet_6mm_closed_cell_foam:0.1,ceiling=ceiling_fissured_tile:0.2"
    out = folder / "ours"
    seconds = run(args.promenade, "simulate", example / "shoebox.obj", "--source", "2,3,1.5", "--materials", materials, "--head", ears,
                  "--at", "6,3,1.2", "--turns", 1, "--rays", args.rays, "--length", args.seconds, "-o", out)
    [file] = [entry["file"] for entry in json.loads((out / "responses.json").read_text())["responses"]]
    return seconds, *sf.read(out / file)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade")
    parser.add_argument("--rays", type=int, default=50_000)
    parser.add_argument("--seconds", type=float, default=2.5)
    args = parser.parse_args()
    package = util.find_spec("acoustic_spaces")
    if package is None:
        print("skipped: acoustic-spaces is not installed")
        return
    example = Path(package.origin).parent / "example_scenes" / "shoebox"
    with tempfile.TemporaryDirectory() as name:
        results = {"acoustic-spaces": theirs(example, Path(name), args), "here": ours(example, Path(name), args)}
    for name, (seconds, response, rate) in results.items():
        response = response if response.ndim == 1 else response[:, 0]
        values = parameters(response, rate)
        print(f"{name}: {seconds:.1f} s of processor time")
        for what, column in zip(["T30, s ", "EDT, s ", "C80, dB"], values.T):
            print(f"  {what} " + " ".join(f"{value:6.2f}" for value in column))


if __name__ == "__main__":
    main()
