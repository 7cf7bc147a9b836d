#!/usr/bin/env python3
"""What a simulated room comes to by octave, and what of it depends on the seed.

    room_octaves.py PROMENADE [--seeds 1] [--low 125] -- box --size 5,4,2.6 --emitter 1.2,0.9,1.4 --head HEAD.sofa --rays 16384
    room_octaves.py PROMENADE -- ROOM.obj --source 2,2,1.4 --materials RULES --head HEAD.sofa --rays 16384 ...

PROMENADE is the program; what follows the dashes are options of `promenade simulate`, which makes responses at eight random
poses unless told otherwise. Seeds draw other random poses too, so that several want a --path. Prints by octave the mean over
poses and ears of

  T20, EDT   slope of the integrated decay from -5 to -25 and from 0 to -10 dB, times 60 dB, s
  C80, D50   energy of the first 80 ms against the rest, dB, and share of the first 50 ms; both from the onset on

and with `--seeds N` by how much the mean over poses of T20 of one seed differs from that of all at most, and its standard
deviation, %.
Needs numpy, scipy and soundfile.
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal


def slope_s(decay_db, high, low, rate):
    piece = np.flatnonzero((decay_db <= high) & (decay_db >= low))
    return -60 / np.polyfit(piece / rate, decay_db[piece], 1)[0] if len(piece) > 2 else np.nan


def measures(ear, rate, octaves):
    """T20, EDT, C80 and D50 by octave."""
    start = int(np.argmax(np.abs(ear) > 0.1 * np.abs(ear).max()))
    rows = []
    for hz in octaves:
        edges = [hz / np.sqrt(2), min(hz * np.sqrt(2), 0.49 * rate)]
        band = signal.sosfiltfilt(signal.butter(3, edges, "band", fs=rate, output="sos"), ear)[start:] ** 2
        decay = 10 * np.log10(np.cumsum(band[::-1])[::-1] / band.sum() + 1e-15)
        early80, early50 = (band[: int(s * rate)].sum() for s in (0.08, 0.05))
        rows.append([slope_s(decay, -5, -25, rate), slope_s(decay, 0, -10, rate),
                     10 * np.log10(early80 / (band.sum() - early80)), early50 / band.sum()])
    return np.array(rows).T


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--low", type=float, default=125, help="the lowest octave, Hz")
    parser.add_argument("simulate", nargs="+")
    args = parser.parse_args()
    octaves = args.low * 2.0 ** np.arange(round(np.log2(8000 / args.low)) + 1)
    poses = [] if {"--poses", "--grid", "--at", "--path"} & set(args.simulate) else ["--poses", "8"]
    seeds = []
    for seed in range(1, 1 + args.seeds):
        with tempfile.TemporaryDirectory() as folder:
            command = [args.promenade, "simulate", *args.simulate, *poses, "--seed", str(seed), "-o", folder + "/room"]
            done = subprocess.run(command, capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(done.stderr.strip())
            room = Path(folder) / "room"
            found = []
            for entry in json.loads((room / "responses.json").read_text())["responses"]:
                ears, rate = sf.read(room / entry["file"])
                found += [measures(ear, rate, octaves) for ear in ears.T]
            seeds.append(np.nanmean(found, axis=0))
    mean = np.mean(seeds, axis=0)
    print("octave, Hz: " + " ".join(f"{hz:.0f}" for hz in octaves))
    for name, row, digits in zip(["T20, s", "EDT, s", "C80, dB", "D50"], mean, [2, 2, 1, 2]):
        print(f"{name}: " + " ".join(f"{v:.{digits}f}" for v in row))
    if args.seeds > 1:
        off = 100 * (np.array(seeds)[:, 0] / mean[0] - 1)
        print("T20 by seed, at most: " + " ".join(f"{v:.1f}" for v in np.abs(off).max(axis=0)) + " %")
        print("standard deviation:   " + " ".join(f"{v:.2f}" for v in off.std(axis=0, ddof=1)) + " %")


if __name__ == "__main__":
    main()
