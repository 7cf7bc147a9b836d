#!/usr/bin/env python3
"""The delay between the ears that a user's head has in a scene, beside that of its own responses.

    head_delays.py PROMENADE SCENE HEAD.sofa X,Y,Z

X,Y,Z is the scene's emitter (`promenade inspect SCENE`). An impulse is rendered with `--head` without its room 1.5 m before the emitter, turned so that it
is heard from eleven azimuths, and the lag of the ears' correlation below 1.5 kHz of the first 3 ms is compared with the responses': as they are, and
equalised for a diffuse field, without the loudspeaker's colour, which a head in a scene does not have. Needs h5py, numpy and soundfile.
"""
import subprocess
import sys
import tempfile

import h5py
import numpy as np
import soundfile as sf

AZIMUTHS = (-150, -120, -90, -60, -30, 0, 30, 60, 90, 120, 150)
RATE = 48000


def lag_us(cross, hz):
    times = np.linspace(-1.2e-3, 1.2e-3, 4801)
    weighed = cross / (1 + (hz / 1500) ** 8)
    return 1e6 * times[np.argmax((weighed * np.exp(2j * np.pi * np.outer(times, hz))).real.sum(1))]


def cross(left, right, rate):
    n = 4096
    return np.fft.rfft(left, n) * np.conj(np.fft.rfft(right, n)), np.fft.rfftfreq(n, 1 / rate)


def main():
    promenade, scene, head, emitter = sys.argv[1:5]
    x, y, z = map(float, emitter.split(","))
    with h5py.File(head) as f:
        responses, places, rate = f["Data.IR"][:], f["SourcePosition"][:], float(f["Data.SamplingRate"][0])
        if f["ReceiverPosition"][:].reshape(2, 3)[0, 1] < 0:
            responses = responses[:, ::-1]
    diffuse = (np.abs(np.fft.rfft(responses, 4096)) ** 2).mean((0, 1))
    errors = []
    with tempfile.TemporaryDirectory() as folder:
        click = np.zeros(RATE // 2)
        click[RATE // 10] = 1
        sf.write(f"{folder}/click.wav", click, RATE, subtype="FLOAT")
        for azimuth in AZIMUTHS:
            pose = f"--pose={x - 1.5},{y},{z},{-azimuth},0,0"
            command = [promenade, "render", scene, f"{folder}/click.wav", f"{folder}/out.wav", pose, "--bits", "32f", "--early=-120", "--late=-120", "--head", head]
            subprocess.run(command, check=True, capture_output=True)
            ears = sf.read(f"{folder}/out.wav")[0].T
            start = min(int(np.argmax(np.abs(e) > 0.1 * np.abs(e).max())) for e in ears) - RATE // 500
            found = lag_us(*cross(*ears[:, start : start + RATE // 200], RATE))
            nearest = np.argmin(np.abs((places[:, 0] - azimuth + 180) % 360 - 180) + 10 * np.abs(places[:, 1]))
            product, hz = cross(*responses[nearest], rate)
            wanted = [lag_us(product, hz), lag_us(product / diffuse, hz)]
            errors.append([found - w for w in wanted])
            print(f"{azimuth:5d}  scene {found:+5.0f} us  off by {errors[-1][0]:+4.0f} from the responses, {errors[-1][1]:+4.0f} from them equalised")
    print("largest", *(f"{e:.0f}" for e in np.abs(errors).max(0)), "us")


main()
