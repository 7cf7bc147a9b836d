"""Cost of image sources and rays beside pyroomacoustics, the same rooms, taking turns in one run.

usage: acoustics_ratio.py BENCH [ROUNDS]

BENCH is the program that `cargo bench --bench tracing -p promenade-acoustics --no-run` builds and names. Unit: processor milliseconds,
the best over rounds. Skips, with status 0, where pyroomacoustics is not installed. What it computes differs in one way: its figures
include the impulse responses of one microphone, ours the images with their gains and the echograms of five listeners.
"""

import os

# Before the first import of anything that starts threads.
os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import re
import subprocess
import sys
import time

try:
    import pyroomacoustics as pra
except ImportError:
    print("skipped: pyroomacoustics is not installed")
    sys.exit(0)

SIZE, SOURCE, LISTENER = [7.0, 5.0, 3.0], [3.1, 2.3, 1.9], [1.0, 1.0, 1.0]
RATE = 16_000


def box(order, rays=0, material=None):
    room = pra.ShoeBox(
        SIZE, fs=RATE, materials=material or pra.Material(0.2, 0.3), max_order=order, ray_tracing=rays > 0, air_absorption=False
    )
    if rays:
        room.set_ray_tracing(n_rays=rays)
    return placed(room, SOURCE, LISTENER)


def l_room(order):
    corners = [[0, 6, 6, 3, 3, 0], [0, 0, 3, 3, 6, 6]]
    room = pra.Room.from_corners(corners, fs=RATE, materials=pra.Material(0.2, 0.3), max_order=order)
    room.extrude(2.7, materials=pra.Material(0.2, 0.3))
    return placed(room, [1.3, 4.9, 1.2], [5.1, 1.4, 1.6])


def placed(room, source, listener):
    room.add_source(source)
    room.add_microphone(listener)
    return room


def milliseconds(make, run):
    room = make()
    began = time.process_time()
    run(room)
    return 1e3 * (time.process_time() - began)


THEIRS = {
    "box, images of order 6": (lambda: box(6), lambda room: room.image_source_model()),
    "L-room, images of order 6": (lambda: l_room(6), lambda room: room.image_source_model()),
    "box, order 3 + 8192 rays, one band": (lambda: box(3, 8192), lambda room: room.compute_rir()),
    "box, order 3 + 8192 rays, octaves": (
        lambda: box(3, 8192, pra.Material("hard_surface")),
        lambda room: room.compute_rir(),
    ),
}
OURS = {
    "box, images of order 6": r"box, order 6, without beams: ([\d.]+) ms",
    "L-room, images of order 6": r"L-room, order 6, 8192 beams: ([\d.]+) ms",
    "box, order 3 + 8192 rays, one band": r"box, 8192 rays of 7 octaves, 1 s, 5 listeners: ([\d.]+) ms",
    "box, order 3 + 8192 rays, octaves": r"box, 8192 rays of 7 octaves, 1 s, 5 listeners: ([\d.]+) ms",
}


def main():
    bench, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5
    theirs = {name: float("inf") for name in THEIRS}
    ours = dict(theirs)
    for _ in range(rounds):
        for name, (make, run) in THEIRS.items():
            theirs[name] = min(theirs[name], milliseconds(make, run))
        text = subprocess.run([bench], check=True, capture_output=True, text=True).stdout
        for name, pattern in OURS.items():
            ours[name] = min(ours[name], float(re.search(pattern, text)[1]))
    print(f"pyroomacoustics {pra.__version__}, best of {rounds} rounds, processor ms")
    for name in THEIRS:
        ratio = ours[name] / theirs[name]
        print(f"{name:<38} ours {ours[name]:9.3f}   theirs {theirs[name]:9.3f}   ratio {ratio:.3f}")


main()
