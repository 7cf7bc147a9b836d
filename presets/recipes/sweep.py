#!/usr/bin/env python3
"""Measures a room by an exponential sweep (Farina 2000): makes the sweep, and responses of recordings of it.

    sweep.py make SWEEP.wav [--seconds 10] [--rate 48000]
    sweep.py responses SWEEP.wav RECORDINGS FOLDER [--seconds 1.5]

`make` writes a mono sweep from 20 Hz to 90 % of the Nyquist frequency with 3 s of silence behind it. RECORDINGS is a folder of
WAV files, left ear first, each begun together with the sweep on one interface. `responses` divides their spectra by the sweep's
and writes files of the same names, 32-bit float, all cut at the same sample 5 ms before the earliest arrival and scaled by one
gain, so that delays and levels stay. Needs numpy and soundfile.
"""
import argparse
from pathlib import Path

import numpy as np
import soundfile

LOWEST_HZ = 20
SILENCE_S = 3
FADE_S = 0.02
LEAD_S = 0.005
# Below this share of the sweep's largest power a frequency is not divided by: it holds noise alone.
FLOOR = 1e-6


def make(path, seconds, rate_hz):
    time = np.arange(round(seconds * rate_hz)) / rate_hz
    octaves = np.log(0.45 * rate_hz / LOWEST_HZ)
    sweep = 0.5 * np.sin(2 * np.pi * LOWEST_HZ * seconds / octaves * np.expm1(time / seconds * octaves))
    fade = np.minimum(1, np.minimum(time, time[::-1]) / FADE_S)
    soundfile.write(path, np.concatenate([sweep * fade, np.zeros(SILENCE_S * rate_hz)]), rate_hz, subtype="FLOAT")


def read(path, rate_hz, channels):
    samples, found_hz = soundfile.read(path, always_2d=True)
    if (found_hz, samples.shape[1]) != (rate_hz, channels):
        found = f"{samples.shape[1]} at {found_hz} Hz"
        raise SystemExit(f"error: {path}: expected {channels} channel(s) at {rate_hz} Hz, found {found}")
    return samples


def responses(sweep_file, recordings, folder, seconds):
    rate_hz = soundfile.info(sweep_file).samplerate
    sweep = read(sweep_file, rate_hz, 1)[:, 0]
    files = sorted(Path(recordings).glob("*.wav"))
    if not files:
        raise SystemExit(f"error: {recordings}: expected files *.wav, found none")
    found, lead = {}, round(LEAD_S * rate_hz)
    for file in files:
        recorded = read(file, rate_hz, 2)
        size = 1 << (len(sweep) + len(recorded) - 1).bit_length()
        spectrum = np.fft.rfft(sweep, size)
        power = np.abs(spectrum) ** 2
        inverse = np.conj(spectrum) / np.maximum(power, FLOOR * power.max())
        response = np.fft.irfft(np.fft.rfft(recorded, size, axis=0) * inverse[:, None], size, axis=0)
        # What arrives with the sweep's first sample begins before it: a circular transform has that at its end.
        found[file.name] = np.roll(response, lead, axis=0)[: len(recorded)]
    loudest = max(np.abs(response).max() for response in found.values())
    onsets = [np.flatnonzero(np.abs(r).max(axis=1) > 0.1 * np.abs(r).max())[0] for r in found.values()]
    first = max(0, min(onsets) - lead)
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, response in found.items():
        cut = response[first : first + round(seconds * rate_hz)] * (0.9 / loudest)
        soundfile.write(Path(folder) / name, cut, rate_hz, subtype="FLOAT")
    print(f"{folder}: {len(found)} responses of {seconds} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    sweep = commands.add_parser("make", help="write the sweep to play")
    sweep.add_argument("sweep")
    sweep.add_argument("--seconds", type=float, default=10)
    sweep.add_argument("--rate", type=int, default=48_000)
    of = commands.add_parser("responses", help="write the responses of recordings of it")
    of.add_argument("sweep")
    of.add_argument("recordings")
    of.add_argument("folder")
    of.add_argument("--seconds", type=float, default=1.5, help="longer than the reverberation")
    args = parser.parse_args()
    if args.command == "make":
        make(args.sweep, args.seconds, args.rate)
    else:
        responses(args.sweep, args.recordings, args.folder, args.seconds)


if __name__ == "__main__":
    main()
