#!/usr/bin/env python3
"""DPAM of what `promenade eval --wavs FOLDER` wrote, with the PyPI package cdpam.

    dpam.py FOLDER [-o dpam.json]

DPAM (Manocha et al. 2021, "CDPAM: Contrastive learning for perceptual audio similarity") is a learnt distance between two recordings of
one sound; smaller is nearer. As in AV-Cloud's evaluation both are limited to full scale, rounded to 16 bits, averaged to one channel and
brought to 22050 Hz: it hears nothing of left and right. It is quoted as a mean over clips for each method.

Needs cdpam 0.0.6 (its weights are in the package), PyTorch, librosa and soundfile.
"""
import argparse
import functools
import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np

# cdpam 0.0.6 was written for NumPy before 1.24, which had these names for Python's own types.
for name, builtin in (("float", float), ("int", int), ("bool", bool)):
    if name not in np.__dict__:
        setattr(np, name, builtin)

import cdpam
import librosa
import soundfile
import torch

RATE_HZ = 22050
RECORDED = ".recorded.wav"


def load():
    """The model. Its weights are a pickle inside the installed package, trusted as far as the package's own code is; PyTorch from 2.6
    on wants to be told so."""
    plain = torch.load
    torch.load = functools.partial(plain, weights_only=False)
    try:
        return cdpam.CDPAM(dev="cpu")
    finally:
        torch.load = plain


def heard(path):
    """One channel as the model takes it: whole numbers of 16 bits, in rows."""
    samples, rate = soundfile.read(path, dtype="float64", always_2d=True)
    rounded = np.round(np.clip(samples, -1.0, 32767 / 32768) * 32768) / 32768
    mono = rounded.mean(axis=1).astype(np.float32)
    if rate != RATE_HZ:
        mono = librosa.resample(mono, orig_sr=rate, target_sr=RATE_HZ)
    return torch.from_numpy(np.round(mono * 32768).astype(np.float32)[None])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="what was given to promenade eval --wavs")
    parser.add_argument("-o", "--output", type=Path, help="JSON file with the value of each clip")
    args = parser.parse_args()
    recordings = sorted(args.folder.rglob("*" + RECORDED))
    if not recordings:
        sys.exit(f"error: {args.folder}: expected files ending in {RECORDED}, found none")
    model = load()
    values = defaultdict(dict)
    for recording in recordings:
        clip = recording.name[: -len(RECORDED)]
        reference = heard(recording)
        for path in sorted(recording.parent.glob(clip + ".*.wav")):
            method = path.name[len(clip) + 1 : -len(".wav")]
            # A clip's name may be the beginning of another's.
            if method == "recorded" or "." in method:
                continue
            with torch.no_grad():
                distance = model.forward(reference, heard(path))
            values[method][f"{recording.parent.name}/{clip}"] = float(distance)
    width = max(map(len, values))
    for method, clips in sorted(values.items(), key=lambda item: np.mean(list(item[1].values()))):
        print(f"{method:<{width}}  {np.mean(list(clips.values())):.4f}  over {len(clips)} clips")
    if args.output:
        args.output.write_text(json.dumps(values, indent=2) + "\n")


if __name__ == "__main__":
    main()
