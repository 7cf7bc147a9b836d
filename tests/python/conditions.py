#!/usr/bin/env python3
"""How true scenes of measured rooms are, condition by condition: the table of accuracy.

    conditions.py PROMENADE HEAD.sofa [--t60 0.3,0.9,2] [--step 10] [--only WORDS] [--head OTHER.sofa]
    conditions.py PROMENADE HEAD.sofa --turning 30,90,360 [--scene SCENE]

PROMENADE is the program, HEAD.sofa a head of the convention SimpleFreeFieldHRIR. `simulate box` makes a ring of responses at ear height, one
every --step degrees, in two places 1 m apart, and the same box at the poses of each condition, which the scene has never seen: the head tilted, up
or down, between azimuths, between places, nearer. A scene is baked of the rings, an impulse rendered at each pose and compared with the response made
there; the nearest measurement (by direction and place) is compared with it as well.

A line is a condition, a column a measure: mean over poses of the magnitude of the error, of the scene / of the nearest measurement. Levels have one
gain for the whole scene, that of the measured poses. Columns:

    onset     us   arrival at the head (mean of both ears) less the sound's way there, less that of the measured poses: not aligned
    itd       us   lag of the correlation below 1.5 kHz, first 10 ms
    ild       dB   thirds of octaves from 200 Hz, rms
    level     dB   thirds of octaves from 100 Hz, rms, both ears
    bass      dB   octaves at 125 and 250 Hz
    room      dB   level after 20 ms, with its sign (mean)
    t20, edt  %    octaves, both ears
    c50       dB   octaves, both ears
    coherence      of the ears after 80 ms, octaves from 500 Hz
    early     dB   above 700 Hz, energy more than 1 ms before an ear's onset over that of its first 2.5 ms, largest; the truth's in place of the nearest's

With --turning, what is heard of steady tones while the head turns, degrees a second: the envelope's modulation from 20 to 40 Hz over its mean, dB, of the
worse ear, of a ring at 48 kHz or of a given scene / of the same scene followed at once, taken from its responses at the poses on the way.

Then cells over one JND (JNDS) and worse than the nearest measurement by a tenth of it are listed. Needs numpy, scipy and soundfile.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

JNDS = {"onset": 20, "itd": 20, "ild": 1, "level": 1, "bass": 1, "room": 1, "t20": 5, "edt": 5, "c50": 1, "coherence": 0.05, "early": -40}
SIZE, SOURCE, PLACE = (6.4, 5.2, 2.9), np.array([3.9, 2.9, 1.5]), np.array([2.4, 2.2, 1.5])
APART_M, SPEED = np.array([0.0, 1.0, 0.0]), 343.2
# Absorption of all walls in octaves from 125 Hz that gives about these reverberation times, seconds.
ABSORPTION = {0.3: 0.33, 0.9: 0.12, 2.0: 0.048}
OCTAVES_HZ = np.array([125, 250, 500, 1000, 2000, 4000, 8000])
THIRDS_HZ = 1000 * 2.0 ** (np.arange(-10, 11) / 3)


def ahead(place):
    """Yaw at which a head sees the source ahead."""
    dx, dy = (SOURCE - place)[:2]
    return np.degrees(np.arctan2(dy, dx))


def pose(place, turn=0.0, pitch=0.0, roll=0.0):
    """A head turned away from the source."""
    return (*place, ahead(np.asarray(place)) + turn, pitch, roll)


def conditions(step):
    """Poses by condition; turns are on measured azimuths but where it says between."""
    turns = step * np.round(np.array([0, 40, 100, 180, 260, 310]) / step)
    found = {"measured": [pose(PLACE, t) for t in turns], "between azimuths": [pose(PLACE, t + 0.5 * step) for t in turns]}
    for angle in (15, 30, 60):
        found[f"pitch {angle}"] = [pose(PLACE, t, a) for t in turns[:4] for a in (angle, -angle)]
        found[f"roll {angle}"] = [pose(PLACE, t, 0, a) for t in turns[:4] for a in (angle, -angle)]
    for up in (0.3, 0.7):
        found[f"up, down {up} m"] = [pose(PLACE + (0, 0, z), t) for t in turns[:4] for z in (up, -up)]
    found["between places"] = [pose(PLACE + along * APART_M, t) for along in (0.25, 0.5) for t in turns]
    found["nearer"] = [pose(PLACE + 0.3 * (SOURCE - PLACE), t) for t in turns]
    return found


def simulate(promenade, head, poses, t60, folder, seed, rate=24000):
    """Both ears' responses at some poses, and the rate."""
    keyframes = [{"t": i, "position": p[:3], "ypr": p[3:]} for i, p in enumerate(np.array(poses).tolist())]
    walk, out = folder / f"walk-{seed}.json", folder / f"responses-{seed}"
    walk.write_text(json.dumps(keyframes))
    where = ["--size", ",".join(map(str, SIZE)), "--emitter", ",".join(map(str, SOURCE)), "--path", walk, "--head", head]
    how = ["--absorption", str(ABSORPTION[t60]), "--length", str(1.3 * t60 + 0.2), "--seed", str(seed), "--order", "12", "--rate", str(rate), "-o", out]
    subprocess.run([promenade, "simulate", "box", *where, *how], check=True, capture_output=True)
    files = [sf.read(out / r["file"], always_2d=True) for r in json.loads((out / "responses.json").read_text())["responses"]]
    return [samples.T for samples, _ in files], files[0][1]


def render(promenade, scene, poses, rate, length, folder, options=()):
    """Both ears' response of a scene at some poses."""
    click, out, x = folder / "click.wav", folder / "out.wav", np.zeros(rate // 4 + length)
    x[rate // 4] = 1
    sf.write(click, x, rate, subtype="FLOAT")
    for p in poses:
        at = "--pose=" + ",".join(f"{v:.6f}" for v in p)
        subprocess.run([promenade, "render", scene, click, out, at, "--bits", "32f", *options], check=True, capture_output=True)
        yield sf.read(out, always_2d=True)[0].T


def onsets(ears):
    """First sample of each ear over a tenth of its peak, linearly between samples."""
    at = []
    for ear in np.abs(ears):
        limit = 0.1 * ear.max()
        i = int(np.argmax(ear > limit))
        at.append(i - 1 + (limit - ear[i - 1]) / (ear[i] - ear[i - 1]) if i else 0.0)
    return np.array(at)


def decay(energy, rate, top, bottom):
    """Reverberation time between two levels of the backward integral, seconds."""
    left = np.cumsum(energy[::-1])[::-1]
    db = 10 * np.log10(left / left[0] + 1e-30)
    first, last = np.argmax(db <= top), np.argmax(db <= bottom)
    return -60 / np.polyfit(np.arange(first, last) / rate, db[first:last], 1)[0] if last > first + 8 else np.nan


def banded(x, rate, centres, width):
    power, f = np.abs(np.fft.rfft(x, 1 << 17)) ** 2, np.fft.rfftfreq(1 << 17, 1 / rate)
    edge = 2 ** (0.5 / width)
    return np.array([power[..., (f >= c / edge) & (f < c * edge)].sum(-1) for c in centres if c * edge < 0.47 * rate]).T


def db(energy):
    return 10 * np.log10(energy + 1e-20)


def figures(ears, rate, way_s=0.0):
    """Measures of a response that starts anywhere; `way_s` is how long the sound is on its way in it."""
    # Waves of the bass begin before the sound has come.
    above = signal.sosfilt(signal.butter(4, 700, "high", fs=rate, output="sos"), ears, axis=1)
    found = onsets(above)
    start = max(0, int(found.min()) - rate // 500)
    x = ears[:, start:]
    direct = rate // 500
    low = signal.sosfiltfilt(signal.butter(4, 1500, fs=rate, output="sos"), x[:, : direct + rate // 100], axis=1)
    fine = signal.resample(low, 16 * low.shape[1], axis=1)
    n, reach = fine.shape[1], 16 * rate // 1000
    lags = np.fft.irfft(np.fft.rfft(fine[0], 2 * n) * np.conj(np.fft.rfft(fine[1], 2 * n)))
    thirds = db(banded(x, rate, THIRDS_HZ, 3))
    octave = [signal.butter(3, [c / 2**0.5, min(c * 2**0.5, 0.48 * rate)], "band", fs=rate, output="sos") for c in OCTAVES_HZ]
    bands = np.array([signal.sosfilt(sos, x, axis=1) for sos in octave])
    late = bands[2:, :, direct + int(0.08 * rate) :]
    each = lambda f: np.array([[f(ear[direct:] ** 2) for ear in band] for band in bands])
    split = int(0.05 * rate)
    peaks = [(ear[: max(0, int(t) - rate // 1000)] ** 2).sum() / (ear[int(t) :][: rate // 400] ** 2).sum() for ear, t in zip(above, found)]
    return {
        "onset": 1e6 * (found.mean() / rate - way_s),
        "itd": 1e6 * (np.argmax(np.r_[lags[-reach:], lags[: reach + 1]]) - reach) / (16 * rate),
        "ild": (thirds[0] - thirds[1])[3:],
        "level": thirds,
        "bass": db(banded(x, rate, OCTAVES_HZ[:2], 1)),
        "room": db((x[:, direct + rate // 50 :] ** 2).sum(1)),
        "t20": 100 * np.log(each(lambda e: decay(e, rate, -5, -25))),
        "edt": 100 * np.log(each(lambda e: decay(e, rate, 0, -10))),
        "c50": each(lambda e: db(e[:split].sum()) - db(e[split:].sum())),
        "coherence": (late[:, 0] * late[:, 1]).sum(-1) / np.sqrt((late**2).sum(-1).prod(-1)),
        "early": db(max(peaks)),
    }


def errors(found, wanted, key):
    if key == "room":
        return np.mean(found[key] - wanted[key])
    if key == "early":
        return found[key]
    of = np.asarray(found[key]) - wanted[key]
    return np.sqrt(np.nanmean(of**2)) if key in ("ild", "level") else np.nanmean(np.abs(of))


def table(promenade, head, t60, options, folder):
    ring = [pose(place, turn) for place in (PLACE, PLACE + APART_M) for turn in np.arange(0, 360, options.step)]
    measured, rate = simulate(promenade, head, ring, t60, folder, 1)
    chosen = {name: poses for name, poses in conditions(options.step).items() if options.only in name or name == "measured"}
    poses = sum(chosen.values(), [])
    truth = [ring.index(p) if p in ring else None for p in poses]
    fresh, _ = simulate(promenade, head, [p for p, known in zip(poses, truth) if known is None] or ring[:1], t60, folder, 2)
    fresh = iter(fresh)
    truth = [next(fresh) if known is None else measured[known] for known in truth]
    scene = folder / "scene.promenade"
    subprocess.run([promenade, "bake", "responses", folder / "responses-1", "--head", head, "-o", scene], check=True, capture_output=True)
    heard = list(render(promenade, scene, poses, rate, truth[0].shape[1], folder, ["--head", options.head] if options.head else []))
    near = [max(range(len(ring)), key=lambda i: towards(ring[i]) @ towards(p) - 0.5 * np.sum((np.subtract(ring[i], p)[:3]) ** 2)) for p in poses]
    way = lambda p: np.linalg.norm(SOURCE - p[:3]) / SPEED
    wanted = [figures(t, rate, way(p)) for t, p in zip(truth, poses)]
    at_nearest = [figures(measured[i], rate, way(ring[i])) for i in near]
    # Levels and arrivals of a scene are against those of its measured poses.
    count = len(chosen["measured"])
    found = [figures(h, rate) for h in heard]
    gain = np.mean([np.mean(f["level"] - w["level"]) for f, w in zip(found[:count], wanted)])
    late = np.mean([f["onset"] - w["onset"] for f, w in zip(found[:count], wanted)])
    for f in found:
        f["onset"] -= late
        for key in ("level", "bass", "room"):
            f[key] = f[key] - gain
    rows, first = {}, 0
    for name, poses in chosen.items():
        part = slice(first, first + len(poses))
        first += len(poses)
        rows[name] = {}
        for key in JNDS:
            mean = np.max if key == "early" else np.mean
            scene_error = mean([errors(f, w, key) for f, w in zip(found[part], wanted[part])])
            beside = wanted if key == "early" else at_nearest
            rows[name][key] = scene_error, mean([errors(f, w, key) for f, w in zip(beside[part], wanted[part])])
    return rows


def flutter_db(envelope, rate):
    """Modulation from 20 to 40 Hz over the mean, of each row, dB."""
    flutter = signal.sosfiltfilt(signal.butter(4, [20, 40], "band", fs=rate, output="sos"), envelope, axis=1)
    return 20 * np.log10(np.sqrt(2) * np.std(flutter, axis=1) / envelope.mean(1))


def turning(promenade, scene, rate, speed, folder):
    """Modulation of tones while the head turns past the front, and of those of the poses on the way, by frequency."""
    seconds, steps_hz = min(3.0, 240 / speed), 200
    start = 10.0
    ends = [start - 0.5 * speed * seconds, start + 0.5 * speed * seconds]
    walk, tone, out = folder / "turn.json", folder / "tone.wav", folder / "turned.wav"
    keyframes = [{"t": seconds * i / 8, "position": [0, 0, 0], "ypr": [ends[0] + (ends[1] - ends[0]) * i / 8, 0, 0]} for i in range(9)]
    walk.write_text(json.dumps(keyframes))
    at = np.arange(0, seconds, 1 / steps_hz)
    poses = [(0, 0, 0, ends[0] + speed * t, 0, 0) for t in at]
    responses = list(render(promenade, scene, poses, rate, rate // 2, folder))
    found = {}
    for hz in (f for f in (500, 1000, 3000, 5000, 8000, 12000) if f < 0.45 * rate):
        turn = np.exp(-2j * np.pi * hz * np.arange(responses[0].shape[1]) / rate)
        at_once = np.abs(np.array([[(ear * turn).sum() for ear in r] for r in responses])).T
        t = np.arange(int(seconds * rate)) / rate
        sf.write(tone, 0.5 * np.sin(2 * np.pi * hz * t), rate, subtype="FLOAT")
        subprocess.run([promenade, "render", scene, tone, out, "--path", walk, "--bits", "32f"], check=True, capture_output=True)
        heard = sf.read(out, always_2d=True)[0].T[:, : len(t)] * np.exp(-2j * np.pi * hz * t)
        envelope = np.abs(signal.resample_poly(heard, 1, rate // 400, axis=1))
        settled = [envelope[:, 160:-40], at_once[:, 80:-20]]
        found[hz] = flutter_db(settled[0], 400).max(), flutter_db(settled[1], steps_hz).max()
    return found


def towards(p):
    """Direction of the source as the head of a pose sees it."""
    yaw, pitch, roll = np.radians(p[3:])
    c, s = np.cos, np.sin
    about_z = np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
    about_y = np.array([[c(pitch), 0, -s(pitch)], [0, 1, 0], [s(pitch), 0, c(pitch)]])
    about_x = np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]])
    v = (about_z @ about_y @ about_x).T @ (SOURCE - p[:3])
    return v / np.linalg.norm(v)


def tones(a, folder):
    """Prints what is heard of tones at each speed."""
    scene = a.scene or folder / "scene.promenade"
    rate = 48000
    if not a.scene:
        simulate(a.promenade, a.sofa, [pose(PLACE, turn) for turn in np.arange(0, 360, a.step)], 0.3, folder, 1, rate)
        manifest = folder / "responses-1" / "responses.json"
        text = json.loads(manifest.read_text())
        for r in text["responses"]:
            # The listener in the origin, the source ahead.
            r["listener"] = {"ypr": [r["listener"]["ypr"][0] - ahead(PLACE), 0, 0]}
            r["source"] = [float(np.linalg.norm(SOURCE - PLACE)), 0, 0]
        manifest.write_text(json.dumps(text))
        subprocess.run([a.promenade, "bake", "responses", manifest, "-o", scene], check=True, capture_output=True)
    for speed in map(float, a.turning.split(",")):
        found = turning(a.promenade, scene, rate, speed, folder)
        print(f"{speed:g} degrees a second: " + ", ".join(f"{hz} Hz {s:.0f} / {o:.0f} dB" for hz, (s, o) in found.items()), flush=True)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("sofa")
    p.add_argument("--t60", default="0.3,0.9,2")
    p.add_argument("--step", type=float, default=10)
    p.add_argument("--only", default="", help="conditions whose names have this")
    p.add_argument("--head", help="heard with this head; the truth stays that of the first")
    p.add_argument("--turning", help="speeds, degrees a second")
    p.add_argument("--scene", help="one measured around the origin, instead of a made ring")
    a = p.parse_args()
    if a.turning:
        with tempfile.TemporaryDirectory() as folder:
            tones(a, Path(folder))
        return
    over = []
    for t60 in map(float, a.t60.split(",")):
        with tempfile.TemporaryDirectory() as folder:
            rows = table(a.promenade, a.sofa, t60, a, Path(folder))
        print(f"\n| T60 {t60:g} s, every {a.step:g} degrees |" + "|".join(f" {key} " for key in JNDS) + "|\n|---|" + "---|" * len(JNDS))
        for name, row in rows.items():
            places = lambda key: {"onset": 0, "itd": 0, "early": 0}.get(key, 2 if key == "coherence" else 1)
            print(f"| {name} |" + "|".join(f" {s:.{places(k)}f} / {n:.{places(k)}f} " for k, (s, n) in row.items()) + "|", flush=True)
            for key, (scene, nearest) in row.items():
                worse = scene > nearest + 1 if key == "early" else abs(scene) > abs(nearest) + 0.1 * JNDS[key]
                if worse and (scene if key == "early" else abs(scene)) > JNDS[key]:
                    over.append(f"T60 {t60:g} s, {name}: {key} {scene:.2f} (nearest {nearest:.2f})")
    print("\nOver one JND and worse than the nearest measurement:\n" + "\n".join(over or ["none"]))


if __name__ == "__main__":
    main()
