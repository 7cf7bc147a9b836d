#!/usr/bin/env python3
"""Compares scenes of image sources with the responses of their room, and listens for clicks while walking.

    geometry_truth.py PROMENADE HEAD.sofa [--room living-room | classroom | FILE.obj --source X,Y,Z --materials RULES]
                      [--within X,Y,X,Y] [--poses 50] [--seeds 1] [--images 60] [--rays 65536] [--scene 'OPTIONS OF SIMULATE'] [--each]

PROMENADE is the program. Poses at random places, between the nodes that the scene knows and at least 1 m off the emitter, looking
anywhere, `--within` two corners of the plan if told: an impulse through the scene against `promenade simulate --path` there. Prints means (and largest values) over the poses of the
magnitudes of differences, above 20 Hz, in:

  itd us, ild dB, t20 %, c50 dB   lag of the ears' largest correlation below 1.5 kHz in the first 10 ms after the onset; ratio of energies;
                                  regression of the decay from -5 to -25 dB; energy in 50 ms after the onset against later
  etc 1, etc 4                    energy in steps of 1 and 4 ms from 3 to 50 ms after the onset, dB rms
  third                           energy in third-octaves from 100 Hz to 16 kHz, dB rms

With `--seeds N` the room is simulated and the scene made N times with other seeds of rays and noise, and energies and correlations are
averaged over them before anything is measured: what is left is the scene's own error. The last row is what the room differs by from
itself with as many other seeds: no scene can do better. Then a listener walks through the room at 1 m/s: of tones, what is heard above
four times their frequency in steps of 10 ms against the running level. Needs numpy, scipy and soundfile.
"""
import argparse
import json
import math
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

RATE = 48_000
LEAD = 48
ROOT = Path(__file__).resolve().parents[2]
# Mesh, emitter, materials; the classroom is Hearing Anything Anywhere's (Wang et al., CC BY 4.0), where it lies beside the checkout.
ROOMS = {
    "living-room": (ROOT / "presets/library/living-room.obj", "4.9,2,1.2", ""),
    "classroom": (ROOT / "../shared/data/haa_meshes/classroom.obj", "2,2,1.4",
                  "floor*=carpet_6mm_closed_cell_foam,ceiling*=acoustical_plaster_25mm,wall*=brick_wall_rough"),
}
HEIGHTS = (1.3, 1.7)
MARGIN_M, NEAREST_M = 0.6, 1.0
THIRDS = 1000 * 2 ** (np.arange(-10, 13) / 3)
OVERSAMPLING = 16
# Image sources add in phase far below what is heard.
HEARD = signal.butter(2, 20, "high", fs=RATE, output="sos")


def run(*command):
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip())
    return done.stdout


def corners(mesh):
    points = np.array([[float(v) for v in line.split()[1:4]] for line in mesh.read_text().splitlines() if line.startswith("v ")])
    return points.min(axis=0), points.max(axis=0)


def plan(args):
    """Lower and upper corner of where poses are."""
    if args.within:
        x, y, *upper = (float(c) for c in args.within.split(","))
        return np.array([x, y]), np.array(upper)
    low, high = corners(args.mesh)
    return low[:2] + MARGIN_M, high[:2] - MARGIN_M


def random_poses(args, source, count):
    low, high = plan(args)
    chance, poses = random.Random(4), []
    while len(poses) < count:
        place = [chance.uniform(low[a], high[a]) for a in range(2)] + [chance.uniform(*HEIGHTS)]
        if math.dist(place, source) >= NEAREST_M:
            poses.append({"t": len(poses), "position": place, "ypr": [chance.uniform(-180, 180), 0, 0]})
    return poses


def onset(ear):
    level = np.abs(ear)
    return int(np.argmax(level > 0.1 * level.max()))


def aligned(ears):
    """Both ears from a little before the earlier onset on."""
    at = min(onset(ear) for ear in ears)
    return np.pad(ears, ((0, 0), (max(0, LEAD - at), 0)))[:, max(0, at - LEAD):]


class Sums:
    """What of a response adds up over seeds."""

    def __init__(self, ears, frames):
        ears = aligned(ears)[:, :frames]
        ears = signal.sosfilt(HEARD, np.pad(ears, ((0, 0), (0, frames - ears.shape[1]))))
        self.energy = ears**2
        self.thirds = np.array([self.third(ears, hz) for hz in THIRDS]).T
        b, a = signal.butter(4, 1500 / (RATE / 2))
        head = slice(LEAD - 8, LEAD + int(0.010 * RATE))
        left, right = (signal.resample_poly(signal.lfilter(b, a, ear)[head], OVERSAMPLING, 1) for ear in ears)
        self.correlation = np.correlate(left, right, "full")

    @staticmethod
    def third(ears, hz):
        edges = [hz * 2 ** (-1 / 6), min(hz * 2 ** (1 / 6), 0.49 * RATE)]
        return (signal.sosfilt(signal.butter(3, edges, "band", fs=RATE, output="sos"), ears) ** 2).sum(axis=1)

    def __add__(self, other):
        total = object.__new__(Sums)
        for name in vars(self):
            setattr(total, name, getattr(self, name) + getattr(other, name))
        return total

    def itd_us(self):
        lags = np.arange(len(self.correlation)) - len(self.correlation) // 2
        near = np.abs(lags) <= 1e-3 * RATE * OVERSAMPLING
        return lags[near][np.argmax(self.correlation[near])] / (RATE * OVERSAMPLING) * 1e6

    def ild_db(self):
        return 10 * np.log10(self.energy[0].sum() / self.energy[1].sum())

    def t20_s(self):
        return np.mean([self.decay_s(ear) for ear in self.energy])

    @staticmethod
    def decay_s(energy):
        decay = np.cumsum(energy[LEAD:][::-1])[::-1]
        decay = 10 * np.log10(decay / decay[0] + 1e-15)
        piece = (decay <= -5) & (decay >= -25)
        return -60 / np.polyfit(np.flatnonzero(piece) / RATE, decay[piece], 1)[0]

    def c50_db(self):
        end = LEAD + int(0.05 * RATE)
        return np.mean([10 * np.log10(ear[:end].sum() / ear[end:].sum()) for ear in self.energy])

    def steps_db(self, ms):
        length = ms * RATE // 1000
        count = 47 // ms
        start = LEAD + 3 * RATE // 1000
        steps = self.energy[:, start : start + count * length].reshape(2, count, length).sum(axis=2)
        return 10 * np.log10(steps + 1e-12 * self.energy.sum())

    def level_db(self):
        return 10 * np.log10(self.energy.sum())

    def against(self, truth):
        rms = lambda mine, other: np.sqrt(np.mean((mine - other - (self.level_db() - truth.level_db())) ** 2))
        return {
            "itd us": abs(self.itd_us() - truth.itd_us()),
            "ild dB": abs(self.ild_db() - truth.ild_db()),
            "t20 %": 100 * abs(self.t20_s() / truth.t20_s() - 1),
            "c50 dB": abs(self.c50_db() - truth.c50_db()),
            "etc 1": rms(self.steps_db(1), truth.steps_db(1)),
            "etc 4": rms(self.steps_db(4), truth.steps_db(4)),
            "third": rms(10 * np.log10(self.thirds + 1e-20), 10 * np.log10(truth.thirds + 1e-20)),
        }


def simulated(args, folder, seed):
    """Both ears' responses of all poses."""
    out = folder / f"room-{seed}"
    run(*args.simulate, "--path", folder / "poses.json", "--seed", seed, "-o", out)
    files = json.loads((out / "responses.json").read_text())["responses"]
    return [sf.read(out / entry["file"])[0].T for entry in files]


def made(args, folder, seed):
    """The scene, and what it makes of an impulse at all poses."""
    scene = folder / f"scene-{seed}.promenade"
    print(run(*args.simulate, "--images", args.images, *args.scene.split(), "--seed", seed, "-o", scene).strip())
    impulse = np.zeros(args.frames + RATE // 4, np.float32)
    impulse[100] = 1
    sf.write(folder / "impulse.wav", impulse, RATE, subtype="FLOAT")

    def heard(numbered):
        number, pose = numbered
        at, out = ",".join(map(str, [*pose["position"], *pose["ypr"]])), folder / f"out-{number}.wav"
        run(args.promenade, "render", scene, folder / "impulse.wav", out, f"--pose={at}", "--bits", "32f")
        return sf.read(out)[0].T

    with ThreadPoolExecutor(2) as pool:
        return scene, list(pool.map(heard, enumerate(args.at)))


def report(name, mine, truth, each):
    rows = [a.against(b) for a, b in zip(mine, truth)]
    value = lambda key: [row[key] for row in rows]
    figures = (f"{key} {np.mean(value(key)):.2f} ({np.max(value(key)):.2f})" for key in rows[0])
    bias = (f"{what} {np.mean([of(a) - of(b) for a, b in zip(mine, truth)]):+.2f}"
            for what, of in [("ild", Sums.ild_db), ("c50", Sums.c50_db), ("t20 s", Sums.t20_s)])
    print(f"{name}: " + "   ".join(figures) + f"; itd median {np.median(value('itd us')):.1f}; signed {', '.join(bias)}")
    if each:
        for number, row in enumerate(rows):
            print(f"  {number:3d} " + "   ".join(f"{key} {v:.2f}" for key, v in row.items()))


def thirds(mine, truth):
    """Mean difference of each third-octave over poses and ears, dB, without the level."""
    off = [10 * np.log10(a.thirds / b.thirds) - a.level_db() + b.level_db() for a, b in zip(mine, truth)]
    off = np.array(off).reshape(-1, len(THIRDS))
    for what, values in [("mean", off.mean(axis=0)), ("rms", np.sqrt((off**2).mean(axis=0)))]:
        print(f"  third-octaves, {what}: " + " ".join(f"{hz:.0f}:{v:.1f}" for hz, v in zip(THIRDS, values)))


def walk(args, folder, scene):
    low, high = plan(args)
    height = 1.5
    start, end = np.array([*(low + 0.2), height]), np.array([*(high - 0.2), height])
    duration = np.linalg.norm(end - start)
    steps = int(20 * duration)
    lines = ["t,x,y,z,yaw,pitch,roll"]
    for i in range(steps + 1):
        x, y, z = start + (end - start) * i / steps
        lines.append(f"{duration * i / steps},{x},{y},{z},{i},0,0")
    (folder / "walk.csv").write_text("\n".join(lines) + "\n")
    time = np.arange(int(duration * RATE)) / RATE
    for hz in (200, 1000, 3000):
        dry, out = folder / "tone.wav", folder / "walked.wav"
        # What a sudden beginning has above the tone would reverberate into the walk.
        rise = 0.5 - 0.5 * np.cos(np.pi * np.minimum(time / 0.2, 1))
        sf.write(dry, 0.25 * rise * np.sin(2 * np.pi * hz * time), RATE, subtype="FLOAT")
        run(args.promenade, "render", scene, dry, out, "--path", folder / "walk.csv", "--bits", "32f")
        ear = sf.read(out)[0][RATE // 2 : len(time) - RATE // 2, 0]
        above = signal.sosfilt(signal.butter(6, 4 * hz, "high", fs=RATE, output="sos"), ear)
        step = RATE // 100
        # The filter's own beginning is none of the walk's.
        powers = [(x[4800:][: (len(x) - 4800) // step * step].reshape(-1, step) ** 2).mean(axis=1) for x in (above, ear)]
        running = np.convolve(powers[1], np.ones(20) / 20, "same")
        off = 10 * np.log10(powers[0] / running)
        print(f"walking 1 m/s, {hz} Hz: above four times that {np.median(off):.1f} dB of the running level, {off.max():.1f} at most")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("promenade")
    parser.add_argument("head")
    parser.add_argument("--room", default="living-room")
    parser.add_argument("--source")
    parser.add_argument("--materials", default="")
    parser.add_argument("--within", help="corners of the plan that poses lie between, metres")
    parser.add_argument("--poses", type=int, default=50)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--images", type=int, default=60)
    parser.add_argument("--rays", type=int, default=65_536)
    parser.add_argument("--scene", default="", help="further options of the scene")
    parser.add_argument("--each", action="store_true")
    args = parser.parse_args()
    mesh, source, materials = ROOMS.get(args.room, (Path(args.room), args.source, args.materials))
    if not mesh.is_file() or not source:
        sys.exit(f"{mesh}: expected a mesh (.obj) and --source")
    args.mesh = mesh
    rules = ["--materials", materials] if materials else []
    args.simulate = [args.promenade, "simulate", mesh, "--source", source, *rules, "--head", args.head, "--rays", args.rays]
    args.at = random_poses(args, [float(c) for c in source.split(",")], args.poses)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "poses.json").write_text(json.dumps(args.at))
        rooms = [[], []]
        for seed in range(2 * args.seeds):
            rooms[seed % 2].append(simulated(args, folder, 1 + seed))
        args.frames = rooms[0][0][0].shape[1]
        scenes = [made(args, folder, 101 + seed) for seed in range(args.seeds)]

        def together(runs):
            totals = [[Sums(ears, args.frames) for ears in one] for one in runs]
            return [sum(pose[1:], pose[0]) for pose in zip(*totals)]

        truth, other, heard = together(rooms[0]), together(rooms[1]), together([responses for _, responses in scenes])
        report("scene", heard, truth, args.each)
        thirds(heard, truth)
        report("the room with other seeds", other, truth, False)
        walk(args, folder, scenes[0][0])


if __name__ == "__main__":
    main()
