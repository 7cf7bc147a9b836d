#!/usr/bin/env python3
"""Compares a simulated room, whose materials are only named, with the measured one: R3VIVAL (Amengual Gari et al., CC BY 4.0), setting 000.

    r3vival_truth.py PROMENADE HEAD.sofa R3VIVAL [--materials RULES] [--directivity PATTERN|FILE.sofa] [--setting 000]

PROMENADE is the program, R3VIVAL the folder with `positions_derived.csv` and `RIRs_flac24`. The room is the box that its authors give, 9.7 x
5.5 x 2.7 m; nothing is fitted. Sources are the loudspeakers at 0, 150, 180, 210 and 330 degrees, 1.5, 2 and 3 m from the array, which they
face. Prints, per octave, the mean T20 over them beside the measured one (the omnidirectional microphone), then energy over distance: means
over the directions of the whole response's level, less that at 1.5 m, from 355 Hz to 2.8 kHz. Needs numpy, scipy and soundfile.
"""
import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

SIZE = (9.7, 5.5, 2.7)
AT = (6.20, 2.75, 1.31)
AZIMUTHS, RADII_M = ("000", "150", "180", "210", "330"), (1.5, 2.0, 3.0)
OCTAVES_HZ = (125, 250, 500, 1000, 2000, 4000, 8000)
# The data name no materials: these are those of a laboratory with a carpet, tiles below the ceiling and wooden panels.
WALLS = "floor=carpet_thin,ceiling=ceiling_fissured_tile,wall=wood_16mm"


def box(file):
    x, y, z = SIZE
    corners = [(i, j, k) for k in (0, z) for j in (0, y) for i in (0, x)]
    faces = {"floor": [(1, 2, 4, 3)], "ceiling": [(5, 7, 8, 6)], "wall": [(1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]}
    lines = [f"v {a} {b} {c}" for a, b, c in corners]
    for name, quads in faces.items():
        lines += [f"usemtl {name}"] + ["f " + " ".join(map(str, quad)) for quad in quads]
    file.write_text("\n".join(lines) + "\n")


def band(samples, rate, low, high):
    return signal.sosfiltfilt(signal.butter(4, (low, min(high, 0.49 * rate)), "bandpass", fs=rate, output="sos"), samples)


def t20(samples, rate):
    """Regression of Schroeder's decay from -5 to -25 dB, after the onset; noise at the end is left out."""
    onset = int(np.argmax(np.abs(samples) > 0.1 * np.abs(samples).max()))
    energy = samples[onset:] ** 2
    left = np.cumsum(energy[::-1])[::-1]
    decay = 10 * np.log10(left / left[0] + 1e-30)
    first, last = np.argmax(decay <= -5), np.argmax(decay <= -25)
    slope = np.polyfit(np.arange(first, last) / rate, decay[first:last], 1)[0]
    return -60 / slope


def simulated(options, mesh, source, folder):
    facing = math.degrees(math.atan2(AT[1] - source[1], AT[0] - source[0]))
    output = folder / "responses"
    place = ",".join(map(str, AT))
    command = [options.promenade, "simulate", mesh, "--source", ",".join(map(str, source)), "--materials", options.materials,
               "--directivity", options.directivity, f"--facing={facing},0", "--head", options.head, "--at", place, "--turns", "1",
               "--rate", "48000", "--length", "1", "-o", output]
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    manifest = json.loads((output / "responses.json").read_text())
    samples, rate = sf.read(output / manifest["responses"][0]["file"])
    subprocess.run(["rm", "-r", str(output)], check=True)
    return samples.T, rate


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("promenade")
    parser.add_argument("head")
    parser.add_argument("data", type=Path)
    parser.add_argument("--materials", default=WALLS)
    parser.add_argument("--directivity", default="omni")
    parser.add_argument("--setting", default="000")
    options = parser.parse_args()
    rows = {row["source"]: row for row in csv.DictReader((options.data / "positions_derived.csv").open())
            if row["absorption_config"] == options.setting}
    times = {"measured": [], "simulated": []}
    levels = {"measured": {r: [] for r in RADII_M}, "simulated": {r: [] for r in RADII_M}}
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        mesh = folder / "lab.obj"
        box(mesh)
        for azimuth in AZIMUTHS:
            for radius in RADII_M:
                row = rows[f"{azimuth}-{round(100 * radius)}"]
                source = tuple(float(row[key]) for key in ("x_m", "y_m", "z_m_inferred"))
                recorded, rate = sf.read(options.data / "RIRs_flac24" / row["file"])
                found = {"measured": [recorded[:, 6]], "simulated": list(simulated(options, mesh, source, folder)[0])}
                for name, channels in found.items():
                    bands = [[band(c, rate, hz / math.sqrt(2), hz * math.sqrt(2)) for c in channels] for hz in OCTAVES_HZ]
                    times[name].append([np.mean([t20(c, rate) for c in one]) for one in bands])
                    energy = sum(np.sum(band(c, rate, 355, 2800) ** 2) for c in channels)
                    levels[name][radius].append(10 * math.log10(energy))
    measured, made = (np.mean(times[name], axis=0) for name in ("measured", "simulated"))
    print("| octave, Hz | T20 measured, s | simulated, s | off |\n|---:|---:|---:|---:|")
    for hz, a, b in zip(OCTAVES_HZ, measured, made):
        print(f"| {hz} | {a:.2f} | {b:.2f} | {100 * (b / a - 1):+.0f} % |")
    print("\n| distance, m | measured, dB | simulated, dB |\n|---:|---:|---:|")
    for radius in RADII_M:
        one = [np.mean(levels[name][radius]) - np.mean(levels[name][RADII_M[0]]) for name in ("measured", "simulated")]
        print(f"| {radius} | {one[0]:+.2f} | {one[1]:+.2f} |")


if __name__ == "__main__":
    main()
