#!/usr/bin/env python3
"""Holds `promenade measure --response` against independent Python references, and prints the largest difference of each measure.

    metrics_check.py PROMENADE FOLDER [FOLDER ...]

PROMENADE is the built command-line tool; FOLDERs hold two-channel WAV responses. Besides them, synthetic signals are checked.
Needs numpy, scipy and soundfile; pyrato (with pyfar) and pyroomacoustics are used where they are installed.

References, and the tolerance for each:
- the definitions in docs/measuring.md written with scipy (butter, lfilter, resample_poly, hilbert): equal up to rounding, so 1e-6 dB
  and 1e-6 relative; ITD 4 us, one step of its grid at 16 kHz, should rounding ever tip two equal maxima.
- pyrato on the same decay curve: T20 and T30 1 %, C50 1e-6 dB. EDT 10 %: it starts its fit at the sample nearest to 0 dB, ours after
  it, and one sample of direct sound weighs that much in a dry room.
- pyroomacoustics.experimental.measure_rt60: T20 and T30 3 % (it picks the ends of its fit its own way).
- scipy STFTs for the AV-Cloud and RWAVS distances: 1e-6 relative.
Exit status 1 if anything is out of tolerance.
"""
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

try:
    import pyfar
    import pyrato
except ImportError:
    pyrato = None
try:
    from pyroomacoustics.experimental import measure_rt60
except ImportError:
    measure_rt60 = None


def onset(h):
    a = np.abs(h)
    return int(np.argmax(a > 0.1 * a.max()))


def itd_us(h, fs):
    up = 16
    b, a = signal.butter(4, 1500 / (fs / 2))
    start = max(0, min(onset(h[0]), onset(h[1])) - 8)
    stop = start + 8 + int(0.010 * fs)
    l, r = (signal.resample_poly(signal.lfilter(b, a, e)[start:stop], up, 1) for e in h)
    lag = np.arange(-len(r) + 1, len(l))
    near = np.abs(lag) <= 1e-3 * fs * up
    return lag[near][np.argmax(np.correlate(l, r, "full")[near])] / (fs * up) * 1e6


def decay(h):
    e = np.cumsum(h[onset(h):][::-1] ** 2)[::-1]
    return 10 * np.log10(e / e[0] + 1e-15)


def decay_time(h, fs, upper, lower):
    d = decay(h)
    k = (d <= upper) & (d >= lower)
    return -60 / np.polyfit(np.arange(len(d))[k] / fs, d[k], 1)[0]


def c50_db(h, fs):
    h = h[onset(h):]
    n = int(0.05 * fs)
    return 10 * np.log10(np.sum(h[:n] ** 2) / np.sum(h[n:] ** 2))


def room(h, fs):
    def mean(f):
        return np.mean([f(e) for e in h])

    return {
        "itd_us": itd_us(h, fs),
        "ild_db": 10 * np.log10(np.sum(h[0] ** 2) / np.sum(h[1] ** 2)),
        "t20_s": mean(lambda e: decay_time(e, fs, -5, -25)),
        "t30_s": mean(lambda e: decay_time(e, fs, -5, -35)),
        "edt_s": mean(lambda e: decay_time(e, fs, 0, -10)),
        "c50_db": mean(lambda e: c50_db(e, fs)),
    }


def tone_cleanliness(x, fs, freq):
    n, hop = 4096, 1024
    f = np.fft.rfftfreq(n, 1 / fs)
    inside = np.abs(f - freq) <= 0.2 * freq
    out, high = [], []
    for i in range(int(0.5 * fs), len(x) - n - int(0.1 * fs), hop):
        p = np.abs(np.fft.rfft(np.hanning(n) * x[i:i + n])) ** 2
        out.append(10 * np.log10(p[~inside].sum() / p[inside].sum()))
        high.append(10 * np.log10(p[f > 2000].sum() / p[inside].sum()))
    return np.median(out), np.max(out), np.median(high), np.max(high)


def magnitudes(x, hop, window):
    window = np.pad(window, (512 - len(window)) // 2)
    x = np.pad(x, 256)
    frames = 1 + (len(x) - 512) // hop
    return np.abs(np.fft.rfft(np.stack([window * x[i * hop:i * hop + 512] for i in range(frames)]), axis=1))


def distances(a, b):
    hamming, hann = signal.get_window("hamming", 400), signal.get_window("hann", 512)
    energy = np.log10((np.sum(np.array([a, b]) ** 2, axis=-1) + 1e-5)) * 10
    env = sum(np.sqrt(np.mean((np.abs(signal.hilbert(p)) - np.abs(signal.hilbert(g))) ** 2)) for p, g in zip(a, b))

    def lsd(p, g):
        p, g = (np.maximum(magnitudes(x, 128, hann), 1e-5) for x in (p, g))
        return np.mean(np.sqrt(np.mean((20 * np.log10(p / g)) ** 2, axis=1)))

    return {
        "avcloud_mag": sum(np.mean(np.abs(magnitudes(p, 160, hamming) - magnitudes(g, 160, hamming))) for p, g in zip(a, b)),
        "avcloud_lre_db": abs((energy[0, 0] - energy[0, 1]) - (energy[1, 0] - energy[1, 1])),
        "avcloud_env": env,
        "rwavs_mag": sum(np.mean((magnitudes(p, 128, hann) - magnitudes(g, 128, hann)) ** 2) for p, g in zip(a, b)),
        "lsd_db_512_128_hann_1e-5": np.mean([lsd(p, g) for p, g in zip(a, b)]),
    }


class Check:
    def __init__(self):
        self.worst = {}

    def add(self, name, found, expected, tolerance, where, relative=False):
        error = abs(found - expected) / (abs(expected) if relative else 1)
        if error >= self.worst.get(name, (-1,))[0]:
            self.worst[name] = (error, tolerance, where, found, expected)

    def report(self):
        ok = True
        for name, (error, tolerance, where, found, expected) in self.worst.items():
            good = error <= tolerance
            ok &= good
            print(f"{'ok  ' if good else 'FAIL'} {name:40s} largest difference {error:.3g}, tolerance {tolerance:g} ({found:.6g} for {expected:.6g}, {where})")
        return ok


TOLERANCES = {"itd_us": (4, False), "ild_db": (1e-6, False), "c50_db": (1e-6, False), "t20_s": (1e-6, True), "t30_s": (1e-6, True), "edt_s": (1e-6, True)}


def measure(tool, *args):
    return json.loads(subprocess.run([tool, "measure", *map(str, args)], check=True, capture_output=True, text=True).stdout)


def check_response(tool, path, check):
    x, fs = sf.read(path, always_2d=True)
    h = x.T
    found = measure(tool, "--response", path)["response"]
    for name, expected in room(h, fs).items():
        tolerance, relative = TOLERANCES[name]
        check.add(f"scipy {name}", found[name], expected, tolerance, path.name, relative)
    if pyrato is not None:
        for key, label, tolerance in (("t20_s", "T20", 0.01), ("t30_s", "T30", 0.01), ("edt_s", "EDT", 0.1)):
            times = [pyrato.parameters.reverberation_time_linear_regression(curve(e, fs), T=label).item() for e in h]
            check.add(f"pyrato {key}", found[key], np.mean(times), tolerance, path.name, True)
        check.add("pyrato c50_db", found["c50_db"], np.mean([pyrato.parameters.clarity(curve(e, fs), early_time_limit=50).item() for e in h]), 1e-6, path.name)
    if measure_rt60 is not None:
        for key, db in (("t20_s", 20), ("t30_s", 30)):
            times = [measure_rt60(e[onset(e):], fs=fs, decay_db=db) for e in h]
            check.add(f"pyroomacoustics {key}", found[key], np.mean(times), 0.03, path.name, True)


def curve(h, fs):
    e = np.cumsum(h[onset(h):][::-1] ** 2)[::-1]
    return pyfar.TimeData(e / e[0], np.arange(len(e)) / fs)


def check_synthetic(tool, folder, check):
    rng = np.random.default_rng(1)
    for fs in (16000, 44100, 48000):
        t = np.arange(int(1.2 * fs)) / fs
        h = rng.standard_normal((2, len(t))) * 10 ** (-3 * t / 0.6) * 0.2
        h[1] = np.roll(h[0], 11) * 0.6 + 0.3 * h[1]
        path = Path(folder) / f"noise_{fs}.wav"
        sf.write(path, h.T, fs, subtype="FLOAT")
        check_response(tool, path, check)
        x = sf.read(path)[0].T

        other = Path(folder) / f"other_{fs}.wav"
        sf.write(other, (h + 0.02 * rng.standard_normal(h.shape) * [[1], [2]]).T, fs, subtype="FLOAT")
        found = measure(tool, "--response", other, "--reference", path)["distance"]
        for name, expected in distances(sf.read(other)[0].T, x).items():
            check.add(f"scipy {name}", found[name], expected, 1e-6, path.name, True)

        t = np.arange(2 * fs) / fs
        tone = np.sin(2 * np.pi * 1000 * t) * (1 + 0.1 * np.sin(2 * np.pi * 3 * t)) + 1e-3 * rng.standard_normal(len(t))
        path = Path(folder) / f"tone_{fs}.wav"
        sf.write(path, 0.5 * np.stack([tone, tone], 1), fs, subtype="FLOAT")
        found = measure(tool, "--response", path, "--tone-hz", 1000)["tone"]
        names = ("outside_median_db", "outside_worst_db", "high_median_db", "high_worst_db")
        for name, expected in zip(names, tone_cleanliness(sf.read(path)[0].T[0], fs, 1000)):
            check.add(f"scipy tone {name}", found[name], expected, 1e-6, path.name)


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    tool, folders = sys.argv[1], [Path(f) for f in sys.argv[2:]]
    check, count = Check(), 0
    with tempfile.TemporaryDirectory() as folder:
        check_synthetic(tool, folder, check)
    for folder in folders:
        for path in sorted(folder.rglob("*.wav")):
            if sf.info(path).channels == 2:
                check_response(tool, path, check)
                count += 1
    ok = check.report()
    print(f"{count} measured responses and the synthetic ones")
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
