#!/usr/bin/env python3
"""Turns the KEMAR responses of the University of Rostock (MATLAB files brir_sweep*.mat) into WAV files and a responses.json.

    rostock_mat_to_wav.py FOLDER_OF_MAT_FILES OUTPUT_FOLDER

One loudspeaker 6.3 m ahead, five head azimuths. The files hold, in a struct `data`: ir (samples x 2 ears), fs, head_azimuth (radians,
positive to the left) and source_position (x right, y ahead). Data: github.com/spatialaudio/communication-acoustics-exercises, CC0.
Needs numpy and scipy.
"""
import json
import sys
from pathlib import Path

import numpy as np
from scipy.io import loadmat, wavfile


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    source, target = Path(sys.argv[1]), Path(sys.argv[2])
    files = sorted(source.glob("brir_sweep*.mat"))
    if not files:
        sys.exit(f"error: {source}: expected files brir_sweep*.mat, found none")
    target.mkdir(parents=True, exist_ok=True)
    loaded = [loadmat(f, squeeze_me=True, struct_as_record=False)["data"] for f in files]
    # One gain for all, so that levels between the poses stay: the loudest sample at 0.9.
    gain = 0.9 / max(np.abs(d.ir).max() for d in loaded)
    entries = []
    for data in loaded:
        yaw = float(np.rad2deg(data.head_azimuth))
        right, ahead, up = (float(v) for v in np.asarray(data.source_position) - np.asarray(data.head_position))
        name = f"kemar_yaw_{yaw:+04.0f}.wav"
        wavfile.write(target / name, int(data.fs), (gain * np.asarray(data.ir)).astype(np.float32))
        entries.append({"file": name, "listener": {"position": [0, 0, 0], "ypr": [round(yaw, 3), 0, 0]}, "source": [ahead, 0.0 - right, up]})
    manifest = {
        "title": "Rostock seminar room, KEMAR turning its head",
        "credit": "University of Rostock, Institute of Communications Engineering (spatialaudio/communication-acoustics-exercises), CC0",
        "licence": "CC0-1.0",
        "note": f"Made by rostock_mat_to_wav.py from {len(files)} files; common gain {gain:.6g}.",
        "responses": sorted(entries, key=lambda e: e["listener"]["ypr"][0]),
    }
    (target / "responses.json").write_text(json.dumps(manifest, indent=2) + "\n")
    print(f"{target}: {len(entries)} responses")


if __name__ == "__main__":
    main()
