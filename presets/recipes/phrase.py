"""Writes data/phrase.flac, the dry phrase of the README, of recordings in Debian's package sonic-pi-samples.

usage: phrase.py SAMPLES data/phrase.flac

SAMPLES is the folder with loop_tabla.flac, guit_harmonics.flac and guit_em9.flac. Needs numpy and soundfile.
"""
import sys
from pathlib import Path

import numpy
import soundfile

RATE_HZ = 44_100
# The tabla plays its loop twice; the guitars come in over it: file, start in loops of the tabla, gain.
PARTS = [("loop_tabla", 0.0, 2.2), ("loop_tabla", 1.0, 2.2), ("guit_harmonics", 0.375, 0.5), ("guit_em9", 1.0, 0.2)]


def recording(folder, name):
    """A recording's channels averaged."""
    samples, rate_hz = soundfile.read(folder / f"{name}.flac", always_2d=True)
    if rate_hz != RATE_HZ:
        raise SystemExit(f"{name}: expected {RATE_HZ} Hz, found {rate_hz}")
    return samples.mean(1)


def main():
    folder, out = map(Path, sys.argv[1:])
    parts = {name: recording(folder, name) for name, _, _ in PARTS}
    loop = len(parts["loop_tabla"])
    phrase = numpy.zeros(2 * loop)
    for name, start, gain in PARTS:
        at = round(start * loop)
        phrase[at : at + len(parts[name])] += gain * parts[name]
    soundfile.write(out, phrase, RATE_HZ, subtype="PCM_16")


if __name__ == "__main__":
    main()
