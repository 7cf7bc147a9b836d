#!/usr/bin/env python3
"""Tries ways to spend a budget of processor time on ten sources.

    budget_trial.py PROMENADE [--seconds 60] [--seed 7]

Ten talkers in the factory scenes, at levels that come and go and at random distances, are rendered as draft and as standard. Every half second a
way to spend chooses what each source plays (nothing, draft or standard) by the loudness of the half second before, within a share of what ten
times standard takes. Prints the mean log-spectral difference of the mix to that of ten times standard, dB (third-octave-wide bands from 80 Hz to
16 kHz, frames of 43 ms down to -50 dB), and the share that was spent:

  allocator     the step that takes off most error for its cost, again and again; a source's error is its energy times what its tier is off by
  loudest, nearest, round-robin     draft for as many as can be in this order, then standard
  uniform       the best tier that all can have

Needs numpy, scipy and soundfile.
"""
import argparse
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

ROOT = Path(__file__).resolve().parents[2]
RATE, SLOT, FADE = 48_000, 24_000, 960
SCENES = ["a", "b", "b", "b", "a", "b", "a", "b", "b", "a"]
# Shares of a core of nothing, draft and standard: `promenade measure` of both scenes; a source that is not played still measures its input.
COSTS = np.array([0.0002, 0.0021, 0.0046])
EDGES = np.geomspace(80, 16_000, 24)


def talkers(chance, seconds):
    """Dry sounds and distances, metres."""
    speech, rate = sf.read(ROOT / "data/speech.wav")
    speech = signal.resample_poly(speech, RATE, rate)
    count = seconds * RATE
    time = np.arange(count) / RATE
    for _ in SCENES:
        away = chance.uniform(1, 12)
        begin = chance.integers(len(speech))
        sound = np.tile(speech, count // len(speech) + 2)[begin : begin + count]
        level = np.interp(time, np.arange(0, seconds + 4, 4), chance.uniform(-24, 0, seconds // 4 + 1))
        talks = np.interp(time, np.arange(0, seconds + 3, 3), (chance.random(seconds // 3 + 1) > 0.35).astype(float))
        yield sound * 10 ** (level / 20) * np.clip(5 * (talks - 0.4), 0, 1) / away, away


def rendered(promenade, scene, dry, yaw, folder):
    """What a source sounds like as nothing, draft and standard."""
    sf.write(folder / "dry.wav", dry.astype(np.float32), RATE, subtype="FLOAT")
    heard = [np.zeros((len(dry), 2), np.float32)]
    for tier in ("draft", "standard"):
        command = [promenade, "render", ROOT / f"presets/scenes/iosr-room-{scene}.promenade", folder / "dry.wav", folder / "wet.wav",
                   "--bits", "32f", "--tier", tier, f"--pose=0,0,0,{yaw},0,0"]
        subprocess.run(list(map(str, command)), check=True, capture_output=True)
        heard.append(sf.read(folder / "wet.wav", dtype="float32")[0][: len(dry)])
    return heard


def levels(mix):
    """Energy by ear, band and frame."""
    hz, _, spectra = signal.stft(mix.T, RATE, nperseg=2048, noverlap=1024)
    power = np.abs(spectra) ** 2
    return np.array([[ear[(hz >= low) & (hz < high)].sum(axis=0) for low, high in zip(EDGES, EDGES[1:])] for ear in power])


def in_order(order, budget):
    plan, left = np.zeros(len(SCENES), int), budget - len(SCENES) * COSTS[0]
    for tier in (1, 2):
        for source in order:
            step = COSTS[tier] - COSTS[tier - 1]
            if plan[source] == tier - 1 and step <= left:
                plan[source], left = tier, left - step
    return plan


def allocated(loudness, off, budget):
    plan, left = np.zeros(len(SCENES), int), budget - len(SCENES) * COSTS[0]
    errors = np.stack([loudness, loudness * off, 0 * loudness])
    while True:
        steps = [((errors[plan[s], s] - errors[t, s]) / (COSTS[t] - COSTS[plan[s]]), s, t)
                 for s in range(len(SCENES)) for t in range(plan[s] + 1, 3) if COSTS[t] - COSTS[plan[s]] <= left]
        gain, source, tier = max(steps, default=(0, 0, 0))
        if gain <= 0:
            return plan
        left -= COSTS[tier] - COSTS[plan[source]]
        plan[source] = tier


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade")
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--seed", type=int, default=7)
    args = parser.parse_args()
    chance = np.random.default_rng(args.seed)
    with tempfile.TemporaryDirectory() as name:
        away, heard = [], []
        for number, (dry, distance) in enumerate(talkers(chance, args.seconds)):
            away.append(distance)
            heard.append(rendered(args.promenade, SCENES[number], dry, 16 * number - 72, Path(name)))
    slots = args.seconds * RATE // SLOT
    energy = lambda x: (x.reshape(slots, -1) ** 2).sum(axis=1)
    loudness = np.array([energy(standard) for _, _, standard in heard])
    off = np.array([energy(draft - standard).sum() for _, draft, standard in heard]) / loudness.sum(axis=1)
    print("draft's error, dB of its source's energy:", np.round(10 * np.log10(off), 1))
    wanted = levels(sum(standard for _, _, standard in heard))
    frames = wanted.sum(axis=(0, 1))
    frames = frames > 1e-5 * frames.max()
    floor = 1e-7 * wanted.max()
    whole = len(SCENES) * COSTS[2]
    for share in (0.15, 0.25, 0.4, 0.5, 0.6, 0.8):
        budget = share * whole * (1 + 1e-9)
        ways = {
            "allocator": lambda slot: allocated(loudness[:, max(slot - 1, 0)], off, budget),
            "loudest": lambda slot: in_order(np.argsort(-loudness[:, max(slot - 1, 0)]), budget),
            "nearest": lambda slot: in_order(np.argsort(away), budget),
            "round-robin": lambda slot: in_order(np.roll(np.arange(len(SCENES)), -slot), budget),
            "uniform": lambda slot: np.full(len(SCENES), max(t for t in range(3) if len(SCENES) * COSTS[t] <= budget)),
        }
        cells = []
        for way, choose in ways.items():
            plan = np.array([choose(slot) for slot in range(slots)]).T
            mix = np.zeros_like(heard[0][0])
            for source, tiers in zip(heard, plan):
                for tier in (1, 2):
                    share_of = np.convolve(np.repeat((tiers == tier).astype(np.float32), SLOT), np.ones(FADE) / FADE, "same")
                    mix += source[tier] * share_of[:, None]
            apart = 10 * np.log10((levels(mix) + floor) / (wanted + floor))[:, :, frames]
            cells.append(f"{way} {np.sqrt((apart**2).mean(axis=1)).mean():.2f} dB ({100 * COSTS[plan].sum() / slots / whole:.0f} %)")
        print(f"{100 * share:.0f} %: " + "  ".join(cells), flush=True)


if __name__ == "__main__":
    main()
