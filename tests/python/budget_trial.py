#!/usr/bin/env python3
"""Tries ways to spend a budget of processor time on many sources.

    budget_trial.py PROMENADE [--seconds 16] [--seed 7] [--drafts OLD]

Speech and bursts of noise in factory scenes, at levels that come and go, are rendered within each error that the plugin's Accuracy has. Every half
second a way to spend chooses what each source plays by the half second before, within a share of what all take in full: 16 sources within a
quarter, 64 within a half, and others. Prints the mean difference of the mix's levels in critical bands to the mix in full, dB (frames of 43 ms down
to -50 dB), and the share that was spent:

  fronts       the step that takes most off the error of the mix for its cost, again and again, as the plugin's budget does
  loudest      in this order as accurate as can be
  uniform      the same error for all, and silence where even the largest costs too much
  drafts       with an OLD program that has the tier draft: nothing, half of the cost without the room, or all

Needs numpy, scipy and soundfile.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

ROOT = Path(__file__).resolve().parents[2]
RATE, SLOT, FADE = 48_000, 24_000, 960
SCENES = [ROOT / f"presets/scenes/{name}.promenade" for name in ("iosr-room-a", "iosr-room-b", "loft")]
SOUNDS = 16
# Accuracies from the least on, differences that are just noticed.
JNDS = [2.0, 1.0, 0.5, 0.25, 0.0]
# Of what all of a scene takes: a source that is not played, and a draft.
WAITING, DRAFT = 0.02, 0.5
BANDS_HZ = [0, 250, 1_000, 4_000, RATE / 2]
EDGES = np.geomspace(80, 16_000, 24)
HELD, MOST_DB, FAINT = 1.6, 20.0, 1e-4


def sounds(chance, seconds):
    """Dry sounds: two of three are speech, the others bursts of noise."""
    speech, rate = sf.read(ROOT / "data/speech.wav")
    speech = signal.resample_poly(speech, RATE, rate)
    count = seconds * RATE
    time = np.arange(count) / RATE
    for number in range(SOUNDS):
        begin = chance.integers(len(speech))
        sound = np.tile(speech, count // len(speech) + 2)[begin : begin + count]
        if number % 3 == 2:
            sound = 0.05 * chance.standard_normal(count) * (np.sin(2 * np.pi * time * chance.uniform(0.5, 3)) > 0)
        talks = np.interp(time, np.arange(0, seconds + 3, 3), (chance.random(seconds // 3 + 1) > 0.3).astype(float))
        yield sound * 10 ** (chance.uniform(-30, 0) / 20) * np.clip(5 * (talks - 0.4), 0, 1)


def rendered(program, scene, dry, folder, *options):
    sf.write(folder / "dry.wav", dry.astype(np.float32), RATE, subtype="FLOAT")
    command = [program, "render", scene, folder / "dry.wav", folder / "wet.wav", "--bits", "32f", *options]
    subprocess.run(list(map(str, command)), check=True, capture_output=True)
    return sf.read(folder / "wet.wav", dtype="float32")[0][: len(dry)]


def levels(mix):
    """Energy by ear, band and frame."""
    hz, _, spectra = signal.stft(mix.T, RATE, nperseg=2048, noverlap=1024)
    power = np.abs(spectra) ** 2
    return np.array([[ear[(hz >= low) & (hz < high)].sum(axis=0) for low, high in zip(EDGES, EDGES[1:])] for ear in power])


def band_powers(sound):
    """By slot and band."""
    spectra = np.abs(np.fft.rfft(sound[: len(sound) // SLOT * SLOT].reshape(-1, SLOT, 2), axis=1)) ** 2
    hz = np.fft.rfftfreq(SLOT, 1 / RATE)
    return np.array([spectra[:, (hz >= low) & (hz < high)].sum(axis=(1, 2)) for low, high in zip(BANDS_HZ, BANDS_HZ[1:])]).T


def greedy(errors, costs, budget, held):
    """What each plays, by what a step takes off the error for its cost; errors and costs are `[source][state]`."""
    plan = np.zeros(len(costs), int)
    left = budget - sum(cost[0] for cost in costs)
    while True:
        best, choice = 0.0, None
        for s, (error, cost) in enumerate(zip(errors, costs)):
            for state in range(plan[s] + 1, len(cost)):
                more = cost[state] - cost[plan[s]]
                worth = (HELD if state <= held[s] else 1.0) * (error[plan[s]] - error[state]) / max(more, 1e-6)
                if more <= left and worth > best:
                    best, choice = worth, (s, state, more)
        if choice is None:
            return plan
        plan[choice[0]], left = choice[1], left - choice[2]


def mix_errors(powers, points):
    """Errors of the mix by source and state: the share of each band that a source has, times how far off it is."""
    mix = powers.sum(axis=0)
    heard = mix > FAINT * mix.max()
    share = powers[:, heard] / np.maximum(mix[heard], 1e-30)
    gone = np.minimum(-10 * np.log10(np.maximum(1 - share, 1e-6)), MOST_DB).mean(axis=1)
    return [[gone[s], *(share[s].mean() * jnd for _, jnd in points[s])] for s in range(len(powers))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade")
    parser.add_argument("--seconds", type=int, default=16)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--drafts")
    args = parser.parse_args()
    chance = np.random.default_rng(args.seed)
    fronts = {}
    for scene in SCENES:
        front = json.loads(subprocess.run([args.promenade, "inspect", scene, "--json"], check=True, capture_output=True).stdout)["front"]
        within = lambda jnds: min((p for p in front if p["jnd"] <= jnds), key=lambda p: p["operations"])
        fronts[scene] = [(within(jnds)["operations"], within(jnds)["jnd"]) for jnds in JNDS]
    states, drafts, of = [], [], []
    with tempfile.TemporaryDirectory() as name:
        for number, dry in enumerate(sounds(chance, args.seconds)):
            scene, pose = SCENES[number % len(SCENES)], f"--pose=0,0,0,{23 * number - 170},0,0"
            play = lambda program, *options: rendered(program, scene, dry, Path(name), pose, *options)
            heard = [play(args.promenade, "--within", jnds) if jnds else play(args.promenade) for jnds in JNDS]
            states.append([np.zeros_like(heard[0]), *heard])
            drafts.append(play(args.drafts, "--tier", "draft") if args.drafts else None)
            of.append(fronts[scene])
    slots = args.seconds * RATE // SLOT
    for count, share in ((16, 0.25), (16, 0.5), (64, 0.25), (64, 0.5), (64, 0.75)):
        # More sources than sounds are the same sounds at other times and levels.
        turn = lambda sound, n: 10 ** (-0.35 * (n // SOUNDS)) * np.roll(sound, 3 * SLOT * (n // SOUNDS), axis=0)
        sources = [[turn(state, n) for state in states[n % SOUNDS]] for n in range(count)]
        points = [of[n % SOUNDS] for n in range(count)]
        costs = np.array([[WAITING, *(cost for cost, _ in p)] for p in points])
        powers = np.array([band_powers(source[-1]) for source in sources])
        wanted = levels(sum(source[-1] for source in sources))
        frames = wanted.sum(axis=(0, 1)) > 1e-5 * wanted.sum(axis=(0, 1)).max()
        floor = 1e-7 * wanted.max()
        budget = share * count * (1 + 1e-9)

        def tried(way, played, costs, choose):
            plan, held = np.zeros((slots, count), int), np.full(count, costs.shape[1] - 1)
            for slot in range(slots):
                plan[slot] = held = choose(powers[:, max(slot - 1, 0)], held)
            mix = np.zeros_like(states[0][0])
            for s in range(count):
                for state in range(1, costs.shape[1]):
                    gain = np.convolve(np.repeat((plan[:, s] == state).astype(np.float32), SLOT), np.ones(FADE) / FADE, "same")
                    if gain.any():
                        mix += played(s, state) * gain[:, None]
            apart = np.abs(10 * np.log10((levels(mix) + floor) / (wanted + floor))[:, :, frames]).mean()
            spent = np.mean([costs[np.arange(count), p].sum() for p in plan]) / count
            print(f"{count} sources within {100 * share:.0f} %: {way} {apart:.2f} dB ({100 * spent:.0f} %)", flush=True)

        def loudest(power, _):
            plan, left = np.zeros(count, int), budget - costs[:, 0].sum()
            for s in np.argsort(-power.sum(axis=1)):
                for state in range(costs.shape[1] - 1, 0, -1):
                    if costs[s, state] - costs[s, 0] <= left:
                        plan[s], left = state, left - (costs[s, state] - costs[s, 0])
                        break
            return plan

        uniform = max((state for state in range(costs.shape[1]) if costs[:, state].sum() <= budget), default=0)
        state_of = lambda s, state: sources[s][state]
        tried("fronts", state_of, costs, lambda power, held: greedy(mix_errors(power, points), costs, budget, held))
        tried("loudest", state_of, costs, loudest)
        tried("uniform", state_of, costs, lambda *_: np.full(count, uniform))
        if args.drafts:
            three = np.tile([WAITING, DRAFT, 1.0], (count, 1))
            draft_of = lambda s, state: sources[s][-1] if state == 2 else turn(drafts[s % SOUNDS], s)
            energies = lambda power: [[p, 0.4 * p, 0.0] for p in power.sum(axis=1)]
            tried("drafts", draft_of, three, lambda power, held: greedy(energies(power), three, budget, held))


if __name__ == "__main__":
    main()
