#!/usr/bin/env python3
"""Simulates the room of the scene Box, makes a walk through it with dry noise, and trains the scene.

    train_box.py MIT_KEMAR_normal_pinna.sofa -o FOLDER [--promenade PROGRAM]

Writes FOLDER/box.promenade, with all it is made of beside it. The room: image sources up to sixth order and a statistical tail, walls that absorb
by frequency, an omnidirectional emitter. The head: the KEMAR responses of Bill Gardner and Keith Martin (MIT Media Lab, 1994). World: metres,
z up, origin in a corner. Needs Python alone, and `promenade` built with the feature `train`. The same seeds make the same scene on the same kind
of processor.
"""
import argparse
import json
import math
import random
import struct
import subprocess
import wave
from pathlib import Path

RATE = 48000
SIZE, EMITTER, START = (7.0, 5.0, 2.8), (5.0, 3.3, 1.4), (2.5, 2.5, 1.5)
# Absorption at the octaves from 125 Hz to 8 kHz of the walls at x = 0, x = 7, y = 0, y = 5, floor, ceiling.
WALLS = [
    (0.15, 0.22, 0.30, 0.35, 0.35, 0.40, 0.45),  # shelf with books
    (0.20, 0.15, 0.10, 0.08, 0.08, 0.10, 0.10),  # plasterboard
    (0.25, 0.15, 0.10, 0.08, 0.06, 0.05, 0.05),  # window
    (0.10, 0.25, 0.40, 0.50, 0.60, 0.60, 0.60),  # curtain
    (0.05, 0.08, 0.14, 0.20, 0.30, 0.40, 0.45),  # carpet
    (0.20, 0.25, 0.30, 0.32, 0.34, 0.35, 0.35),  # thin ceiling panels
]
# Listeners keep so far from walls and emitter, metres.
MARGIN, FROM_EMITTER = 0.5, 0.5
SECONDS, BURST_S, PAUSE_S = 40, 0.3, 0.2
# The dry sound is made for deconvolution, so that the responses of clips teach more than their magnitudes. The late part begins where T20 has ended.
SETTINGS = {
    "network": {"taps": 72, "tap_shapes": 4},
    "loss": {"n_fft": [512], "log": 0.05, "linear": 0.05, "ratio": 0.002, "level": 0.1, "delay": 0.002},
    "rate": 0.005,
}
CREDIT = "Simulated; KEMAR responses by Bill Gardner and Keith Martin, MIT Media Lab, 1994"
LICENCE = "MIT OR Apache-2.0; the KEMAR responses may be used freely with credit"


def walk(count, rng):
    """Poses anywhere in the room, the first one before the emitter and facing it, a second each."""
    yaw = math.degrees(math.atan2(EMITTER[1] - START[1], EMITTER[0] - START[0]))
    poses = [{"t": 0, "position": START, "ypr": [yaw, 0, 0]}]
    while len(poses) < count:
        place = [rng.uniform(MARGIN, size - MARGIN) for size in SIZE]
        if math.dist(place, EMITTER) >= FROM_EMITTER:
            ypr = [rng.uniform(-180, 180), rng.uniform(-30, 30), rng.uniform(-15, 15)]
            poses.append({"t": len(poses), "position": place, "ypr": ypr})
    return poses


def bursts(rng):
    """Noise that falls by about 3 dB an octave, with pauses in which the room dies away; 16 bit."""
    corners = [(math.exp(-2 * math.pi * hz / RATE), math.sqrt(2 * math.pi * hz / RATE) * RATE / hz / 200) for hz in (50, 200, 800, 3200, 12800)]
    states, samples = [0.0] * len(corners), []
    for i in range(SECONDS * RATE):
        x, y = rng.gauss(0, 1), 0.0
        for k, (pole, gain) in enumerate(corners):
            states[k] = pole * states[k] + (1 - pole) * x
            y += gain * states[k]
        samples.append(y if (i / RATE) % (BURST_S + PAUSE_S) < BURST_S else 0.0)
    loudest = max(map(abs, samples))
    return struct.pack(f"<{len(samples)}h", *(round(32000 * y / loudest) for y in samples))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sofa", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder")
    parser.add_argument("--promenade", default="promenade")
    parser.add_argument("--poses", type=int, default=500)
    parser.add_argument("--steps", type=int, default=800)
    parser.add_argument("--seed", type=int, default=1, help="of poses, noise and clips")
    parser.add_argument("--training-seed", type=int, default=3, help="of weights and carriers")
    args = parser.parse_args()
    rng, out = random.Random(args.seed), args.output
    out.mkdir(parents=True, exist_ok=True)

    def run(*words):
        print("promenade", *words, flush=True)
        subprocess.run([args.promenade, *map(str, words)], check=True)

    (out / "walk.json").write_text(json.dumps(walk(args.poses, rng)))
    (out / "settings.json").write_text(json.dumps(SETTINGS))
    with wave.open(str(out / "dry.wav"), "wb") as dry:
        dry.setparams((1, 2, RATE, 0, "NONE", ""))
        dry.writeframes(bursts(rng))
    absorption = ";".join("/".join(map(str, wall)) for wall in WALLS)
    place, size = (",".join(map(str, v)) for v in (EMITTER, SIZE))
    run("simulate", "box", "--size", size, "--emitter", place, "--materials", absorption, "--head", args.sofa,
        "--path", out / "walk.json", "--rate", RATE, "--seed", args.seed, "-o", out / "room")
    manifest = out / "room/responses.json"
    manifest.write_text(json.dumps(json.loads(manifest.read_text()) | {"credit": CREDIT, "licence": LICENCE}))
    run("capture", "from-responses", out / "room", "--dry", out / "dry.wav", "--test-share", 0.1, "--seed", args.seed, "-o", out / "capture")
    run("anchors", "--box", size, "-n", 64, "--seed", args.seed, "-o", out / "anchors.safetensors")
    run("train", out / "capture", "--anchors", out / "anchors.safetensors", "--settings", out / "settings.json", "--steps", args.steps,
        "--seed", args.training_seed, "--title", "Box, a simulated room", "-o", out / "box.promenade")
    run("bake", "less", out / "box.promenade", "-o", out / "box.promenade")


if __name__ == "__main__":
    main()
