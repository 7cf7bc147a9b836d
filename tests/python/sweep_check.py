#!/usr/bin/env python3
"""Holds `presets/recipes/sweep.py` against responses that are known: recordings of its sweep through them are made here.

    sweep_check.py SWEEP.PY

Two directions of a head, each a direct sound, three reflections and a decaying noise tail, at both ears, recorded 40 ms late on
one interface, with noise 80 dB below the loudest. What comes back, between 40 Hz and 18 kHz:
- the known response times one gain for both files, to -50 dB of its energy;
- delays of an ear beside the other and of one file beside the other, to a hundredth of a sample;
- the earliest arrival 5 ms after the beginning.
Recordings at another rate, of one channel, or none are refused by name. Exit status 1 if anything is out of tolerance.
"""
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile
from scipy import signal

RATE_HZ = 48_000
LATE_S = 0.04
SCRIPT = Path(sys.argv[1]).resolve()


def run(folder, *args):
    return subprocess.run([sys.executable, SCRIPT, *args], cwd=folder, capture_output=True, text=True)


def check(holds, words):
    print(f"{'ok    ' if holds else 'FAILED'}  {words}")
    return holds


def known(delays, gains, seed):
    """A response: direct sounds at each ear, reflections at fractions of samples, and a tail of 0.3 s to -60 dB."""
    noise = np.random.default_rng(seed).standard_normal((RATE_HZ // 2, 2))
    time = np.arange(len(noise)) / RATE_HZ
    tail = 0.004 * noise * 10 ** (-3 * time / 0.3)[:, None] * (time > 0.01)[:, None]
    at = np.arange(len(tail))
    for ear in range(2):
        for extra, gain in ((0, 1), (211.3, 0.4), (397.8, 0.3), (640.1, 0.2)):
            from_peak = at - delays[ear] - extra
            window = np.where(np.abs(from_peak) < 32, np.cos(np.pi * from_peak / 64) ** 2, 0)
            tail[:, ear] += gain * gains[ear] * np.sinc(from_peak) * window
    return tail


def band(response):
    padded = np.pad(response, ((RATE_HZ // 2, RATE_HZ // 2), (0, 0)))
    return signal.sosfiltfilt(signal.butter(4, (40, 18_000), "bandpass", fs=RATE_HZ, output="sos"), padded, axis=0)


def delay(one, other):
    """Samples by which one signal is later than another, from the slope of their cross-spectrum's phase, 200 Hz to 4 kHz."""
    size = 1 << 16
    cross = np.fft.rfft(one, size) * np.conj(np.fft.rfft(other, size))
    hz = np.fft.rfftfreq(size, 1 / RATE_HZ)
    coarse = np.argmax(signal.correlate(one, other)) - (len(other) - 1)
    cross *= np.exp(2j * np.pi * hz * coarse / RATE_HZ)
    use = (hz > 200) & (hz < 4000)
    slope = np.polyfit(hz[use], np.unwrap(np.angle(cross[use])), 1, w=np.abs(cross[use]))[0]
    return coarse - slope * RATE_HZ / (2 * np.pi)


def main():
    passed = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = run(folder, "make", "sweep.wav", "--seconds", "6")
        sweep, rate_hz = soundfile.read(folder / "sweep.wav")
        passed &= check(made.returncode == 0 and rate_hz == RATE_HZ and len(sweep) == 9 * RATE_HZ, "a sweep of 6 s and 3 s of silence")
        heard = {"yaw_-30.wav": known((130.0, 141.6), (0.9, 0.5), 1), "yaw_30.wav": known((143.3, 133.9), (0.35, 0.7), 2)}
        (folder / "recordings").mkdir()
        for file, response in heard.items():
            recorded = signal.fftconvolve(sweep[:, None], response, axes=0)[: len(sweep)]
            recorded = np.concatenate([np.zeros((round(LATE_S * RATE_HZ), 2)), recorded])
            noise = np.random.default_rng(9).standard_normal(recorded.shape)
            soundfile.write(folder / "recordings" / file, recorded + 1e-4 * noise * np.abs(recorded).max(), RATE_HZ, subtype="FLOAT")
        made = run(folder, "responses", "sweep.wav", "recordings", "room", "--seconds", "0.6")
        passed &= check(made.stdout.strip() == "room: 2 responses of 0.6 s", made.stdout.strip() or made.stderr.strip())
        found = {file: soundfile.read(folder / "room" / file)[0] for file in heard}
        # One gain and one shift for both, those of the first.
        first = "yaw_-30.wav"
        passed &= check(abs(max(np.abs(f).max() for f in found.values()) - 0.9) < 1e-6, "the loudest sample is 0.9")
        shift = round(delay(found[first][:, 0], heard[first][:, 0]))
        passed &= check(abs(shift + 130 - 0.005 * RATE_HZ) < 5, f"the earliest arrival is at {1000 * (shift + 130) / RATE_HZ:.3f} ms")
        for file, response in heard.items():
            size = len(found[file])
            spectrum = np.fft.rfft(np.pad(response, ((0, size - len(response)), (0, 0))), axis=0)
            moved = spectrum * np.exp(-2j * np.pi * np.fft.rfftfreq(size, 1 / RATE_HZ) * shift / RATE_HZ)[:, None]
            wanted, got = band(np.fft.irfft(moved, size, axis=0)), band(found[file])
            if file == first:
                gain = np.sum(wanted * got) / np.sum(wanted**2)
            error_db = 10 * np.log10(np.sum((got - gain * wanted) ** 2) / np.sum((gain * wanted) ** 2))
            passed &= check(error_db < -50, f"{file}: {error_db:.1f} dB beside what is known")
            off = delay(*found[file].T) - delay(*response.T)
            passed &= check(abs(off) < 0.01, f"{file}: delay between ears off by {off:.4f} samples")
        between = delay(found["yaw_30.wav"][:, 0], found[first][:, 0]) - delay(heard["yaw_30.wav"][:, 0], heard[first][:, 0])
        passed &= check(abs(between) < 0.01, f"delay between files off by {between:.4f} samples")

        silence = np.zeros((RATE_HZ, 2))
        for wrong, samples, rate in (("rate.wav", silence, 44_100), ("mono.wav", silence[:, 0], RATE_HZ)):
            (folder / wrong[:-4]).mkdir()
            soundfile.write(folder / wrong[:-4] / wrong, samples, rate)
            said = run(folder, "responses", "sweep.wav", wrong[:-4], "none")
            words = said.stderr.strip()
            passed &= check(said.returncode == 1 and wrong in words and "expected 2 channel(s) at 48000 Hz" in words, words)
        (folder / "empty").mkdir()
        said = run(folder, "responses", "sweep.wav", "empty", "none")
        passed &= check(said.returncode == 1 and "empty: expected files *.wav, found none" in said.stderr, said.stderr.strip())
    sys.exit(0 if passed else 1)


main()
