#!/usr/bin/env python3
"""What is heard on a line through a place that was measured every metre: its level, and combs that move with the listener.

    line_truth.py PROMENADE HEAD.sofa [--apart METRES]

A box of 6.4 x 5.2 x 2.9 m is made by image sources (all within the length of the responses; each by the nearest response of the head), in
4 x 3 places, 1 m apart unless --apart says otherwise, with 18 turns of the head in each, and baked. An impulse is rendered every tenth of
that distance along a line through four places and compared with the same box made there. Printed are

- the level along the line less that of the box, in all and by octave, dB: least, mean and largest, one gain for the whole line;
- combs: of the direct sound (2.5 ms) and of the first 50 ms, the power spectrum from 500 Hz to 16 kHz, smoothed over 100 Hz, less that of the box,
  dB; the cepstrum of this from 0.25 to 8 ms, of which the largest line is a comb's ripple (its amplitude, dB). Largest along the line
  and its mean, of the scene, of the nearest measurement, and of the two nearest mixed by sample.

HEAD.sofa is a head of the convention SimpleFreeFieldHRIR. Needs h5py, numpy, scipy and soundfile.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import h5py
import numpy as np
import soundfile as sf

from poses_truth import OCTAVES_HZ, aligned, bands_db, rendered

BOX_M, SOURCE_M, FIRST_M = np.array([6.4, 5.2, 2.9]), np.array([5.3, 3.9, 1.4]), np.array([1.2, 1.1, 1.5])
WALLS = np.array([[0.82, 0.88], [0.85, 0.8], [0.8, 0.86]])
COLUMNS, ROWS, TURNS = 4, 3, 18
LENGTH_S, SPEED, TAPS = 0.4, 343.0, 16
LEAD = 64


class Head:
    def __init__(self, path):
        with h5py.File(path) as f:
            self.responses = np.asarray(f["Data.IR"])
            self.rate = int(np.ravel(f["Data.SamplingRate"])[0])
            seen = np.radians(np.asarray(f["SourcePosition"])[:, :2])
        up = np.sin(seen[:, 1])
        self.towards = np.c_[np.cos(seen[:, 1]) * np.cos(seen[:, 0]), np.cos(seen[:, 1]) * np.sin(seen[:, 0]), up]


def images():
    """Places of the images and what the walls leave of each, as in Allen and Berkley (J. Acoust. Soc. Am. 65, 1979)."""
    reach = LENGTH_S * SPEED
    axes = []
    for size, source, walls in zip(BOX_M, SOURCE_M, WALLS):
        n = np.arange(-int(reach / size) - 2, int(reach / size) + 3)
        flips = np.abs(n)[:, None] // 2 + np.where(n[:, None] % 2 == 0, 0, np.stack([n < 0, n > 0], 1))
        axes.append((np.where(n % 2 == 0, n * size + source, (n + 1) * size - source), (walls**flips).prod(1)))
    places = np.stack(np.meshgrid(*[a[0] for a in axes], indexing="ij"), -1).reshape(-1, 3)
    gains = np.einsum("i,j,k->ijk", *[a[1] for a in axes]).ravel()
    return places, gains


def room(head, places, gains, listener, yaw_deg):
    """Both ears' response of the box, LENGTH_S long."""
    away = places - listener
    distance = np.linalg.norm(away, axis=1)
    near = distance < LENGTH_S * SPEED - 1
    away, distance, gains = away[near], distance[near], gains[near]
    c, s = np.cos(np.radians(yaw_deg)), np.sin(np.radians(yaw_deg))
    seen = (away / distance[:, None]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    which = np.concatenate([np.argmax(part @ head.towards.T, axis=1) for part in np.array_split(seen, 64)])
    n = int(LENGTH_S * head.rate)
    at = distance / SPEED * head.rate + TAPS
    whole = np.floor(at).astype(int)
    sent = np.zeros((len(head.towards), n + 2 * TAPS))
    for k in range(-TAPS // 2 + 1, TAPS // 2 + 1):
        x = whole + k - at
        np.add.at(sent, (which, whole + k), gains / distance * np.sinc(x) * np.cos(np.pi * x / (TAPS + 1)) ** 2)
    size = 1 << (n + 2 * TAPS + head.responses.shape[2]).bit_length()
    spectra = np.fft.rfft(sent, size)
    return np.stack([np.fft.irfft((spectra * np.fft.rfft(head.responses[:, ear], size)).sum(0))[:n] for ear in (0, 1)])


def ripple(ears, wanted, rate, length_s):
    """Amplitude of the strongest comb in what a response's power spectrum has over the wanted one's, dB."""
    size = 1 << 15
    f = np.fft.rfftfreq(size, 1 / rate)
    band = np.hanning(2 * int(100 * size / rate) + 1)
    db = []
    for x in (ears, wanted):
        n = LEAD + int(length_s * rate)
        fade = np.r_[np.ones(n - rate // 2000), np.linspace(1, 0, rate // 2000)]
        power = np.abs(np.fft.rfft(x[:, :n] * fade, size)) ** 2
        db.append([10 * np.log10(np.convolve(p, band, "same") + 1e-20) for p in power])
    over = (np.array(db[0]) - db[1])[:, (f >= 500) & (f < 16000)]
    over = (over - over.mean(1, keepdims=True)) * np.hanning(over.shape[1])
    lines = np.abs(np.fft.rfft(over, 1 << 15)) * 4 / over.shape[1]
    quefrency = np.fft.rfftfreq(1 << 15, rate / size)
    return lines[:, (quefrency > 0.25e-3) & (quefrency < 8e-3)].max()


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("head")
    p.add_argument("--apart", type=float, default=1.0)
    a = p.parse_args()
    head, (places, gains) = Head(a.head), images()
    rate = head.rate
    with tempfile.TemporaryDirectory() as temporary:
        folder, responses = Path(temporary), []
        line = {}
        for column in range(COLUMNS):
            for row in range(ROWS):
                at = FIRST_M + a.apart * np.array([column, row, 0])
                for turn in range(TURNS):
                    yaw, name = 360 * turn / TURNS, f"{column}_{row}_{turn}.wav"
                    ears = room(head, places, gains, at, yaw)
                    if (row, turn) == (1, 0):
                        line[column] = ears
                    sf.write(folder / name, 0.5 * ears.T, rate, subtype="FLOAT")
                    responses.append({"file": name, "listener": {"position": list(at), "ypr": [yaw, 0, 0]}})
        manifest = folder / "responses.json"
        manifest.write_text(json.dumps({"title": "Box", "credit": "made", "source": list(SOURCE_M), "responses": responses}))
        scene = folder / "scene.promenade"
        subprocess.run([a.promenade, "bake", "responses", manifest, "-o", scene], check=True, capture_output=True)
        steps = np.arange(0, COLUMNS - 1 + 1e-9, 0.1)
        poses = [(*(FIRST_M + a.apart * np.array([step, 1, 0])), 0, 0, 0) for step in steps]
        truth = [room(head, places, gains, np.array(pose[:3]), 0) for pose in poses]
        heard = list(rendered(a.promenade, scene, poses, rate, LENGTH_S, folder))
    n = int(LENGTH_S * rate)
    cut = lambda ears: aligned(ears, n)
    rows = {
        "scene": [cut(y) for y in heard],
        "nearest": [cut(line[round(step)]) for step in steps],
        "mixed": [cut(mixed(line, step)) for step in steps],
    }
    wanted = [cut(t) for t in truth]
    for name, row in rows.items():
        level = lambda f: np.array([f(y) - f(t) for y, t in zip(row, wanted)])
        octaves = level(lambda x: bands_db(x, rate, OCTAVES_HZ, 1).mean(1))
        whole = level(lambda x: 10 * np.log10((x**2).sum()))
        columns = np.c_[whole - whole.mean(), octaves - octaves.mean(0)]
        print(f"{name:8s} level dB, all and by octave from {OCTAVES_HZ[0]} Hz: " + ", ".join(f"{c.min():.1f} .. {c.max():.1f}" for c in columns.T))
        for length in (0.0025, 0.05):
            combs = np.array([ripple(y, t, rate, length) for y, t in zip(row, wanted)])
            print(f"{'':8s} comb of the first {1e3 * length:g} ms, dB: largest {combs.max():.2f}, mean {combs.mean():.2f}; " + " ".join(f"{c:.1f}" for c in combs))


def mixed(line, step):
    """The two nearest measurements, by their distance."""
    left = min(int(step), COLUMNS - 2)
    return (1 - (step - left)) * line[left] + (step - left) * line[left + 1]


if __name__ == "__main__":
    main()
