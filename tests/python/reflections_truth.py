#!/usr/bin/env python3
"""How true early reflections stay when the source goes away from where a ring of it was measured: R3VIVAL (Amengual Gari et al., CC BY 4.0).

    reflections_truth.py PROMENADE R3VIVAL [--setting 000] [--lengths 9.7,5.5,2.7]

PROMENADE is the program, R3VIVAL the folder with `positions_derived.csv` and `RIRs_flac24`. A scene is baked from the responses of the
loudspeakers 1.5 m from the array, the omnidirectional microphone at both ears, without the room's lengths and with them, and heard where
those at 2 and 3 m were measured. Prints, for each distance, how far energies in steps of 1 ms from 3 to 20 ms after the direct sound are
off, dB rms, at one level for the scene; and at 1.5 m the part of the first 50 ms that is missed, dB. Needs numpy, soundfile and netCDF4.
"""
import argparse
import csv
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import netCDF4
import numpy as np
import soundfile as sf

AT = (6.20, 2.75, 1.31)
RATE = 48000


def omnidirectional_head(path):
    """A head of two ears in one place, so that images are heard as the microphone hears them."""
    step = np.radians(15)
    directions = [(np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)) for e in np.radians([-60, -30, 0, 30, 60]) for a in np.arange(24) * step]
    count = len(directions)
    with netCDF4.Dataset(path, "w", format="NETCDF4") as file:
        for name, value in {"Conventions": "SOFA", "Version": "1.0", "SOFAConventions": "SimpleFreeFieldHRIR", "DataType": "FIR", "Title": "omnidirectional",
                            "RoomType": "free field", "License": "CC0"}.items():
            setattr(file, name, value)
        for name, size in {"I": 1, "C": 3, "R": 2, "E": 1, "M": count, "N": 128}.items():
            file.createDimension(name, size)

        def add(name, axes, values, **more):
            made = file.createVariable(name, "f8", axes)
            made[:] = values
            for key, value in more.items():
                setattr(made, key, value)
        cartesian = {"Type": "cartesian", "Units": "metre"}
        add("ListenerPosition", ("I", "C"), [[0, 0, 0]], **cartesian)
        add("ListenerView", ("I", "C"), [[1, 0, 0]], **cartesian)
        add("ListenerUp", ("I", "C"), [[0, 0, 1]], **cartesian)
        add("ReceiverPosition", ("R", "C", "I"), np.array([[0, 0.09, 0], [0, -0.09, 0]])[:, :, None], **cartesian)
        add("EmitterPosition", ("E", "C", "I"), np.zeros((1, 3, 1)), **cartesian)
        add("SourcePosition", ("M", "C"), 2 * np.array(directions), **cartesian)
        samples = np.zeros((count, 2, 128))
        samples[:, :, 40] = 1
        add("Data.IR", ("M", "R", "N"), samples)
        add("Data.SamplingRate", ("I",), [RATE], Units="hertz")
        add("Data.Delay", ("I", "R"), np.zeros((1, 2)))


def echogram(ear):
    onset = int(np.argmax(np.abs(ear) > 0.1 * np.abs(ear).max()))
    step = RATE // 1000
    part = ear[onset + 3 * step:onset + 20 * step]
    return 10 * np.log10((part.reshape(17, step) ** 2).sum(1) + 1e-12)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("promenade")
    parser.add_argument("data", type=Path)
    parser.add_argument("--setting", default="000")
    parser.add_argument("--lengths", default="9.7,5.5,2.7")
    options = parser.parse_args()
    size = [float(length) for length in options.lengths.split(",")]
    rows = [row for row in csv.DictReader((options.data / "positions_derived.csv").open())
            if row["absorption_config"] == options.setting and row["radius_m"] in ("1.5", "2.0", "3.0")]
    measured = {}
    for row in rows:
        samples, rate = sf.read(options.data / "RIRs_flac24" / row["file"])
        assert rate == RATE
        measured[float(row["radius_m"]), int(row["azimuth_deg_from_front"])] = (samples[:, 6], [float(row[key]) for key in ("x_m", "y_m", "z_m_inferred")])
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        head = folder / "omni.sofa"
        omnidirectional_head(head)
        entries = []
        for (radius, azimuth), (samples, source) in measured.items():
            if radius == 1.5:
                sf.write(folder / f"{azimuth}.wav", np.stack([samples, samples], 1), RATE, subtype="FLOAT")
                entries.append({"file": f"{azimuth}.wav", "source": source})
        manifest = {"title": "ring", "listener": {"position": AT, "ypr": [180, 0, 0]}, "responses": entries}
        click = np.zeros(RATE)
        click[RATE // 4] = 1
        sf.write(folder / "click.wav", click, RATE, subtype="FLOAT")
        print("| | missed at 1.5 m, dB | 2 m, dB | 3 m, dB |\n|---|---:|---:|---:|")
        for name, room in (("without lengths", None), ("with lengths", {"size": size, "moves": "source"})):
            (folder / "responses.json").write_text(json.dumps(manifest | ({"room": room} if room else {})))
            scene = folder / "ring.promenade"
            done = subprocess.run([options.promenade, "bake", "responses", folder, "--head", head, "-o", scene], capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(done.stderr.strip())
            print(done.stderr.strip(), done.stdout.strip(), file=sys.stderr)
            errors, missed = {2.0: [], 3.0: []}, []
            for (radius, azimuth), (samples, source) in sorted(measured.items()):
                # As the head, which looks along -x, sees the source.
                left = np.degrees(np.arctan2(-(source[1] - AT[1]), -(source[0] - AT[0])))
                pose = f"--pose={1.5 - radius},0,0,{-left},0,0"
                subprocess.run([options.promenade, "render", scene, folder / "click.wav", folder / "out.wav", pose, "--bits", "32f"], check=True, capture_output=True)
                heard = sf.read(folder / "out.wav")[0][:, 0]
                if radius == 1.5:
                    length = 2400
                    onset = max(0, int(np.argmax(np.abs(samples) > 0.1 * np.abs(samples).max())) - 20)
                    wanted = samples[onset:onset + length]
                    found = [heard[RATE // 4 + lag:][:length] for lag in range(-60, 60)]
                    missed.append(min(1 - (wanted @ h) ** 2 / ((wanted @ wanted) * (h @ h)) for h in found))
                else:
                    errors[radius].append(echogram(heard) - echogram(samples))
            level = np.mean(errors[2.0] + errors[3.0])
            off = [np.sqrt(np.mean((np.array(errors[r]) - level) ** 2)) for r in (2.0, 3.0)]
            print(f"| {name} | {10 * np.log10(max(missed)):.1f} | {off[0]:.2f} | {off[1]:.2f} |")


if __name__ == "__main__":
    main()
