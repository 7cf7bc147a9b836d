#!/usr/bin/env python3
"""How loud a scene rings before the onset of a stroke, beside the measurements that it was made of.

    onset_truth.py PROMENADE SCENE PATTERN DRY.wav [--held-out=-85..85/10]

PROMENADE is the program, PATTERN names the measured responses, two channels, with {azimuth}, positive to the right. The loudest stroke of DRY.wav,
250 ms from its onset, is rendered with the head turned to the left by each held-out azimuth, at the responses' rate, and convolved with the
measurement there. Both are compared at the lag that most of them have, within 1 ms. Prints the largest sample more than half a millisecond
before the onset, over the largest of all, dB: at worst and in the median over azimuths and ears. The onset is where the measurement first
comes within 60 dB of its peak. Needs numpy, scipy and soundfile.
"""
import argparse
import math
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

STROKE_S, REACH_S, GAP_S, LEAD_S = 0.25, 0.001, 0.0005, 0.1


def stroke(path, rate):
    """The loudest stroke of a file at a rate, with silence before it and after it."""
    dry, found = sf.read(path, always_2d=True)
    divisor = math.gcd(found, rate)
    dry = signal.resample_poly(dry[:, 0], rate // divisor, found // divisor)
    onset = peak = int(np.argmax(np.abs(dry)))
    while onset > 0 and np.abs(dry[max(0, onset - 16) : onset]).max() > 0.01 * abs(dry[peak]):
        onset -= 1
    one = dry[onset : onset + int(STROKE_S * rate)].copy()
    one[-200:] *= np.linspace(1, 0, 200)
    return np.concatenate([np.zeros(int(LEAD_S * rate)), one, np.zeros(rate)])


def before_db(ear, onset):
    """The largest sample before an onset over the largest of all, dB."""
    return 20 * math.log10(np.abs(ear[:onset]).max() / np.abs(ear).max() + 1e-9)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("scene")
    p.add_argument("pattern")
    p.add_argument("dry")
    p.add_argument("--held-out", default="-85..85/10")
    args = p.parse_args()
    ends, step = args.held_out.split("/")
    first, last = map(int, ends.split(".."))
    pairs, dry, rate = [], None, None
    with tempfile.TemporaryDirectory() as folder:
        source, out = Path(folder) / "dry.wav", Path(folder) / "out.wav"
        for azimuth in range(first, last + 1, int(step)):
            response, rate = sf.read(args.pattern.replace("{azimuth}", str(azimuth)))
            if dry is None:
                dry = stroke(args.dry, rate)
                sf.write(source, dry, rate, subtype="FLOAT")
            command = [args.promenade, "render", args.scene, source, out, "--pose", f"0,0,0,{azimuth},0,0"]
            subprocess.run(command, check=True, capture_output=True)
            heard, _ = sf.read(out)
            for ear in range(2):
                measured = signal.fftconvolve(dry, response[:, ear])
                length = min(len(measured), len(heard))
                pairs.append((heard[:length, ear], measured[:length]))
    alike = [np.abs(signal.fftconvolve(heard, measured[::-1])) for heard, measured in pairs]
    middle = int(np.median([int(np.argmax(a)) - (len(m) - 1) for a, (_, m) in zip(alike, pairs)]))
    reach, gap = int(REACH_S * rate), int(GAP_S * rate)
    found = []
    for similarity, (heard, measured) in zip(alike, pairs):
        at = len(measured) - 1 + middle
        lag = middle - reach + int(np.argmax(similarity[at - reach : at + reach + 1]))
        onset = int(np.argmax(np.abs(measured) > 1e-3 * np.abs(measured).max())) - gap
        found.append((before_db(np.roll(heard, -lag), onset), before_db(measured, onset)))
    for name, values in zip(("scene", "measured"), zip(*found)):
        print(f"{name}: worst {max(values):.1f} dB, median {np.median(values):.1f} dB, {len(values)} ears")


if __name__ == "__main__":
    main()
