#!/usr/bin/env python3
"""How true scenes of measured rooms are, condition by condition: the table of accuracy.

    conditions.py PROMENADE HEAD.sofa [--t60 0.3,0.9,2] [--step 10] [--only WORDS] [--head OTHER.sofa]
    conditions.py PROMENADE HEAD.sofa --turning 30,90,360 [--scene SCENE]
    conditions.py PROMENADE --within JND --scene SCENE
    conditions.py PROMENADE --measured MANIFEST --root FOLDER [--steps 10,45,one] [--opinion PROGRAM SOUND...]

PROMENADE is the program, HEAD.sofa a head of the convention SimpleFreeFieldHRIR. `simulate box` makes a ring of responses at ear height, one
every --step degrees, in two places 1 m apart, and the same box at the poses of each condition, which the scene has never seen: the head tilted, up
or down, between azimuths, between places, nearer. A scene is baked of the rings, an impulse rendered at each pose and compared with the response made
there; the nearest measurement (by direction and place) is compared with it as well. So are, between azimuths, each latency and other rates of the host,
and a further source that is heard from a measured direction while the scene's own is silent. --head hears with another head, and makes the truth with it.

A line is a condition, a column a measure: mean over poses of the magnitude of the error, of the scene / of the nearest measurement. Levels have one
gain for the whole scene, that of the measured poses. Columns:

    onset     us   arrival at the head (mean of both ears) less the sound's way there, less that of the measured poses: not aligned. Within 1 ms of
                   each other sounds fuse (Blauert 1997, summing localisation); a quarter of that is allowed
    itd       us   lag of the correlation below 1.5 kHz, first 10 ms
    direct    us   the same of the direct sound, first 2.5 ms
    ild       dB   thirds of octaves from 200 Hz, rms
    level     dB   thirds of octaves from 100 Hz, rms, both ears
    bass      dB   octaves at 125 and 250 Hz
    room      dB   level after 20 ms, with its sign (mean)
    t20, edt  %    octaves, both ears
    c50       dB   octaves, both ears
    coherence      of the ears after 80 ms, octaves from 500 Hz
    early     dB   above 700 Hz, energy more than 1 ms before an ear's onset over that of its first 2.5 ms, largest; the truth's in place of the nearest's

Then a walk of 1 m/s from one place to the other: noise by octave in frames of 100 ms against the box made every 5 cm, rms dB.

With --turning, what is heard of steady tones while the head turns, degrees a second: the envelope's modulation from 20 to 40 Hz over its mean, dB, of the
worse ear, of a ring at 48 kHz or of a given scene / of the same scene followed at once, taken from its responses at the poses on the way.

With --within, a scene is its own truth at the poses of all conditions about its start pose: what of it stays within that many just noticeable
differences by its front is compared with all of it, mean over poses, over one JND.

With --measured, responses of a room (as in presets/recipes), of which one every --steps degrees is baked, or all but one, each in its turn: the others are
the truth, and the same columns are printed, then by how much energies from 2 to 5 ms after the arrival are off, 500 Hz to 2 kHz and 2 to 6 kHz (mean, dB). With --opinion what ViSQOL
predicts that people say of each SOUND, 5 at best; PROGRAM is what visqol.sh builds.

Cells over one JND (JNDS) and worse than the nearest measurement by a tenth of it are listed. Needs numpy, scipy and soundfile.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

JNDS = {"onset": 250, "itd": 20, "direct": 20, "ild": 1, "level": 1, "bass": 1, "room": 1, "t20": 5, "edt": 5, "c50": 1, "coherence": 0.05, "early": -40}
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
    found["every latency"] = found["every rate"] = found["between azimuths"]
    found["a further source"] = found["measured"]
    found["nearer"] = [pose(PLACE + 0.3 * (SOURCE - PLACE), t) for t in turns]
    return found


def simulate(promenade, head, poses, t60, folder, seed, rate=24000):
    """Both ears' responses at some poses, and the rate."""
    keyframes = [{"t": i, "position": p[:3], "ypr": p[3:]} for i, p in enumerate(np.array(poses).tolist())]
    walk, out = folder / f"walk-{seed}.json", folder / f"responses-{seed}"
    walk.write_text(json.dumps(keyframes))
    where = ["--size", ",".join(map(str, SIZE)), "--emitter", ",".join(map(str, SOURCE)), "--path", walk, "--head", head]
    how = ["--materials", str(ABSORPTION[t60]), "--length", str(1.3 * t60 + 0.2), "--seed", str(seed), "--order", "12", "--rate", str(rate), "-o", out]
    subprocess.run([promenade, "simulate", "box", *where, *how], check=True, capture_output=True)
    files = [sf.read(out / r["file"], always_2d=True) for r in json.loads((out / "responses.json").read_text())["responses"]]
    return [samples.T for samples, _ in files], files[0][1]


def render(promenade, scene, poses, rate, length, folder, options=(), further=None):
    """Both ears' response of a scene at some poses; with `further` that of a source there, while the scene's own is silent."""
    click, silence, out, x = folder / "click.wav", folder / "silence.wav", folder / "out.wav", np.zeros(rate // 4 + length)
    sf.write(silence, x, rate, subtype="FLOAT")
    x[rate // 4] = 1
    sf.write(click, x, rate, subtype="FLOAT")
    for i, p in enumerate(poses):
        what = [click] if further is None else [silence, "--source=" + ",".join(f"{v:.6f}" for v in further[i]) + f"={click}"]
        at = "--pose=" + ",".join(f"{v:.6f}" for v in p)
        subprocess.run([promenade, "render", scene, what[0], out, at, "--bits", "32f", *what[1:], *options], check=True, capture_output=True)
        yield sf.read(out, always_2d=True)[0].T


def heard_of(promenade, scene, name, poses, rate, length, folder, options):
    """Responses of a scene under a condition, and the number of the pose of each."""
    ways = {"every latency": [["--latency", "64"], ["--latency", "none"]], "every rate": [44100, 48000, 96000]}
    if name == "a further source":
        # Where the head that looks at the scene's own source sees it as in the pose.
        turned = [signal_at(p[:3], p[3] - ahead(np.array(p[:3]))) for p in poses]
        facing = [pose(np.array(p[:3])) for p in poses]
        return list(render(promenade, scene, facing, rate, length, folder, options, turned)), list(range(len(poses)))
    found, numbers = [], []
    for way in ways.get(name, [[]]):
        host = rate if isinstance(way, list) else way
        more = [*options, *way] if isinstance(way, list) else options
        for i, h in enumerate(render(promenade, scene, poses, host, length * host // rate, folder, more)):
            # Without latency what is rendered comes a quarter of a hop later.
            h = h[:, rate // 800 :] if way == ["--latency", "none"] else h
            common = np.gcd(host, rate)
            found.append(h if host == rate else host / rate * signal.resample_poly(h, rate // common, host // common, axis=1))
            numbers.append(i)
    return found, numbers


def signal_at(place, turn):
    """Where a source is that is seen from a place as the source is after a turn of the head."""
    c, s = np.cos(np.radians(-turn)), np.sin(np.radians(-turn))
    x, y, z = SOURCE - np.asarray(place)
    return np.asarray(place) + (c * x - s * y, s * x + c * y, z)


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


def lag_us(ears, rate):
    """Delay of the left ear after the right, at which they correlate most, us."""
    fine = signal.resample(ears, 16 * ears.shape[1], axis=1)
    n, reach = fine.shape[1], 16 * rate // 1000
    lags = np.fft.irfft(np.fft.rfft(fine[0], 2 * n) * np.conj(np.fft.rfft(fine[1], 2 * n)))
    return 1e6 * (np.argmax(np.r_[lags[-reach:], lags[: reach + 1]]) - reach) / (16 * rate)


def figures(ears, rate, way_s=0.0):
    """Measures of a response that starts anywhere; `way_s` is how long the sound is on its way in it."""
    # Waves of the bass begin before the sound has come.
    above = signal.sosfilt(signal.butter(4, 700, "high", fs=rate, output="sos"), ears, axis=1)
    found = onsets(above)
    start = max(0, int(found.min()) - rate // 500)
    x = ears[:, start:]
    direct = rate // 500
    lowpass = signal.butter(4, 1500, fs=rate, output="sos")
    lag = lambda part: lag_us(signal.sosfiltfilt(lowpass, part, axis=1), rate)
    thirds = db(banded(x, rate, THIRDS_HZ, 3))
    octave = [signal.butter(3, [c / 2**0.5, min(c * 2**0.5, 0.48 * rate)], "band", fs=rate, output="sos") for c in OCTAVES_HZ]
    bands = np.array([signal.sosfilt(sos, x, axis=1) for sos in octave])
    late = bands[2:, :, direct + int(0.08 * rate) :]
    each = lambda f: np.array([[f(ear[direct:] ** 2) for ear in band] for band in bands])
    split = int(0.05 * rate)
    peaks = [(ear[: max(0, int(t) - rate // 1000)] ** 2).sum() / (ear[int(t) :][: rate // 400] ** 2).sum() for ear, t in zip(above, found)]
    return {
        "onset": 1e6 * (found.mean() / rate - way_s),
        "itd": lag(x[:, : direct + rate // 100]),
        "direct": lag(x[:, : direct + rate // 400] * np.r_[np.ones(direct + rate // 500), np.linspace(1, 0, rate // 400 - rate // 500)]),
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


def compared(chosen, heard, truth, nearest):
    """Errors of what was `heard` under each condition, by number of its pose, and of the nearest measurements: by condition and measure.

    `truth` and `nearest` are measures at all poses in a row; the first condition is the measured poses."""
    first, rows = 0, {}
    for number, (name, poses) in enumerate(chosen.items()):
        found, at = heard[name]
        wanted = [truth[first + i] for i in at]
        beside = [nearest[first + i] for i in at]
        if number == 0:
            gain = np.mean([np.mean(f["level"] - w["level"]) for f, w in zip(found, wanted)])
            late = np.mean([f["onset"] - w["onset"] for f, w in zip(found, wanted)])
        for f in found:
            # Another latency begins on time as well; a rate of the host's moves it by less than its sample.
            f["onset"] -= late
            for key in ("level", "bass", "room"):
                f[key] = f[key] - gain
        rows[name] = {}
        for key in JNDS:
            mean = np.max if key == "early" else np.mean
            scene_error = mean([errors(f, w, key) for f, w in zip(found, wanted)])
            rows[name][key] = scene_error, mean([errors(f, w, key) for f, w in zip(wanted if key == "early" else beside, wanted)])
        first += len(poses)
    return rows


def table(promenade, head, t60, options, folder):
    ring = [pose(place, turn) for place in (PLACE, PLACE + APART_M) for turn in np.arange(0, 360, options.step)]
    measured, rate = simulate(promenade, head, ring, t60, folder, 1)
    chosen = {name: poses for name, poses in conditions(options.step).items() if options.only in name or name == "measured"}
    poses = sum(chosen.values(), [])
    fresh = list(dict.fromkeys(p for p in poses if p not in ring or options.head)) or ring[:1]
    made, _ = simulate(promenade, options.head or head, fresh, t60, folder, 2)
    truth = [made[fresh.index(p)] if p in fresh else measured[ring.index(p)] for p in poses]
    scene = folder / "scene.promenade"
    subprocess.run([promenade, "bake", "responses", folder / "responses-1", "--head", head, "-o", scene], check=True, capture_output=True)
    more, length = ["--head", options.head] if options.head else [], truth[0].shape[1]
    heard = {}
    for name, at in chosen.items():
        sounds, numbers = heard_of(promenade, scene, name, at, rate, length, folder, more)
        heard[name] = [figures(h, rate) for h in sounds], numbers
    near = [max(range(len(ring)), key=lambda i: towards(ring[i]) @ towards(p) - 0.5 * np.sum((np.subtract(ring[i], p)[:3]) ** 2)) for p in poses]
    way = lambda p: np.linalg.norm(SOURCE - p[:3]) / SPEED
    wanted = [figures(t, rate, way(p)) for t, p in zip(truth, poses)]
    at_nearest = [figures(measured[i], rate, way(ring[i])) for i in near]
    rows = compared(chosen, heard, wanted, at_nearest)
    walk = None if options.only else walked(promenade, head, scene, ring, measured, t60, rate, folder)
    return rows, walk


def walked(promenade, head, scene, ring, measured, t60, rate, folder):
    """Levels of noise by octave on a walk from one place to the other at 1 m/s, rms over frames and ears of the error, dB: of the scene / of the
    nearest measurement, switched."""
    steps = np.linspace(0, 1, 21)
    line = [(*(PLACE + along * APART_M), ahead(PLACE) + 40, 0, 0) for along in steps]
    made, _ = simulate(promenade, head, line, t60, folder, 3)
    rest = int((0.3 + t60) * rate)
    dry = np.random.default_rng(1).normal(size=rest + rate)
    noise, out, path = folder / "noise.wav", folder / "walked.wav", folder / "line.json"
    sf.write(noise, 0.1 * dry, rate, subtype="FLOAT")
    keys = [(0, line[0])] + [((rest + along * rate) / rate, p) for along, p in zip(steps, line)]
    path.write_text(json.dumps([{"t": t, "position": list(map(float, p[:3])), "ypr": list(map(float, p[3:]))} for t, p in keys]))
    subprocess.run([promenade, "render", scene, noise, out, "--path", path, "--bits", "32f"], check=True, capture_output=True)
    heard = sf.read(out, always_2d=True)[0].T[:, : len(dry)]

    def followed(responses):
        """What is heard of responses every 5 cm, each faded into the next."""
        sum_, at = np.zeros((2, len(dry))), (np.arange(len(dry)) - rest) / rate * (len(steps) - 1)
        for i, r in enumerate(responses):
            share = np.clip(1 - np.abs(np.clip(at, 0, len(steps) - 1) - i), 0, 1)
            sum_ += share * signal.fftconvolve(0.1 * dry[None], r, axes=1)[:, : len(dry)]
        return sum_

    near = [measured[max(range(len(ring)), key=lambda i: towards(ring[i]) @ towards(p) - 0.5 * np.sum((np.subtract(ring[i], p)[:3]) ** 2))] for p in line]
    frame, out = rate // 10, []
    for c in OCTAVES_HZ[OCTAVES_HZ < 0.4 * rate]:
        sos = signal.butter(3, [c / 2**0.5, min(c * 2**0.5, 0.48 * rate)], "band", fs=rate, output="sos")
        levels = [db((signal.sosfilt(sos, x, axis=1)[:, rest : rest + 10 * frame].reshape(2, 10, frame) ** 2).mean(2)) for x in (heard, followed(made), followed(near))]
        off = [x - levels[1] for x in (levels[0], levels[2])]
        # One gain for the walk, as a scene has one.
        out.append([np.sqrt(np.mean((x - x.mean()) ** 2)) for x in off])
    return out


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


def measurements(manifest, folder):
    """Name, ears and rate, direction seen from the head (degrees) and pose of each response of a manifest."""
    text = json.loads(Path(manifest).read_text())
    sign = -1 if text.get("azimuth_positive") == "right" else 1
    entries = list(text.get("responses", []))
    for entry in text.get("patterns", []) + ([{"file": text["pattern"]}] if "pattern" in text else []):
        before, after = entry["file"].split("{azimuth}")
        for file in sorted(Path(folder).glob(before + "*" + after)):
            azimuth = str(file.relative_to(folder))[len(before) : len(str(file.relative_to(folder))) - len(after)]
            entries.append(entry | {"file": str(file.relative_to(folder)), "azimuth_deg": sign * float(azimuth)})
    out = []
    for entry in entries:
        samples, rate = sf.read(Path(folder) / entry["file"], always_2d=True)
        if "listener" in entry:
            (x, y, z), (yaw, pitch, roll) = entry["listener"]["position"], entry["listener"]["ypr"]
            pose = (x, y, z, yaw, pitch, roll)
            assert pitch == roll == 0, "only level heads turn here"
            dx, dy, dz = (s - p for s, p in zip(entry.get("source", text.get("source")), (x, y, z)))
            seen = (np.degrees(np.arctan2(dy, dx)) - yaw, np.degrees(np.arctan2(dz, np.hypot(dx, dy))))
        else:
            seen, pose = (entry["azimuth_deg"], entry.get("elevation_deg", 0)), None
        distance = entry.get("distance_m", text.get("distance_m", 0))
        out.append({"title": text["title"], "name": Path(entry["file"]).stem, "ears": samples.T, "rate": rate, "seen": seen, "pose": pose, "distance": distance})
    ahead = np.mean([m["distance"] for m in out])
    for m in out:
        m["pose"] = m["pose"] or turned(m["seen"], ahead - m["distance"])
    return out


def turned(seen, x):
    """The pose of a head that has an emitter ahead of the origin in a direction: the room turns with the head."""
    azimuth, elevation = np.radians(seen)
    c, s = np.cos, np.sin
    about_z = np.array([[c(azimuth), s(azimuth), 0], [-s(azimuth), c(azimuth), 0], [0, 0, 1]])
    about_y = np.array([[c(elevation), 0, s(elevation)], [0, 1, 0], [-s(elevation), 0, c(elevation)]])
    r = about_y @ about_z
    angles = np.arctan2(r[1, 0], r[0, 0]), np.arcsin(np.clip(r[2, 0], -1, 1)), np.arctan2(r[2, 1], r[2, 2])
    return (x, 0, 0, *np.degrees(angles))


def unit(seen):
    azimuth, elevation = np.radians(seen)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def left_out(a, folder):
    """Prints how true a scene of some responses of a room is where the others were measured."""
    all_, even = measurements(a.measured, a.root), json.loads(Path(a.measured).read_text()).get("levels") == "even"
    rate, scene = all_[0]["rate"], folder / "scene.promenade"
    band = signal.butter(4, [500, 4000], "band", fs=rate, output="sos")
    for m in all_:
        m["ears"] = np.pad(m["ears"], ((0, 0), (rate // 10, rate)))
        late = signal.sosfilt(band, m["ears"], axis=1)[:, int(onsets(m["ears"]).min()) + rate * 8 // 100 :][:, : rate // 5]
        m["ears"] /= np.sqrt((late**2).sum()) if even else 1
    for step in a.steps.split(","):
        turns = [m["seen"][0] for m in all_]
        on_grid = lambda turn: step != "one" and abs(turn - float(step) * round(turn / float(step))) < 0.1
        inside = [t for t in turns if on_grid(t)]
        away = [i for i, t in enumerate(turns) if not on_grid(t) and (step == "one" or min(inside) < t < max(inside))]
        heard, near, kept = {}, {}, {}
        for group in [[i] for i in away] if step == "one" else [away]:
            held = [i for i, t in enumerate(turns) if i in group or (step != "one" and not on_grid(t))]
            rule = "names=" + ",".join(all_[i]["name"] for i in held)
            bake = [a.promenade, "bake", "responses", a.measured, "--root", a.root, "--hold-out", rule, "-o", scene]
            subprocess.run(bake, check=True, capture_output=True)
            near |= {i: max((k for k in range(len(all_)) if k not in held), key=lambda k: unit(all_[k]["seen"]) @ unit(all_[i]["seen"])) for i in group}
            known = sorted({near[i] for i in group})
            sounds = list(render(a.promenade, scene, [all_[i]["pose"] for i in group + known], rate, rate, folder))
            # A scene is normalised to its loudest response; where one was measured it is exact.
            gain = np.sqrt(sum((all_[k]["ears"] ** 2).sum() for k in known) / sum((h**2).sum() for h in sounds[len(group) :]))
            heard |= {i: gain * h for i, h in zip(group, sounds)}
            kept |= {k: gain * h for k, h in zip(known, sounds[len(group) :])}
        measures = lambda ears: [figures(e, rate) for e in ears]
        own, beside = [all_[i]["ears"] for i in away], [all_[near[i]]["ears"] for i in away]
        at = {"measured": list(kept), "left out, one by one" if step == "one" else f"between every {step} degrees": away}
        found = {name: (measures((kept if name == "measured" else heard)[i] for i in numbers), range(len(numbers))) for name, numbers in at.items()}
        truth = measures([all_[k]["ears"] for k in kept] + own)
        print_table(all_[0]["title"], compared(at, found, truth, truth[: len(kept)] + measures(beside)), [])
        for lo, hi in ((500, 2000), (2000, 6000)):
            sos = signal.butter(3, [lo, hi], "band", fs=rate, output="sos")

            def soon(ears):
                start = int(np.mean(onsets(signal.resample_poly(ears, 8, 1, axis=1))) / 8)
                return db((signal.sosfiltfilt(sos, ears, axis=1)[:, start + rate // 500 : start + rate // 200] ** 2).sum())

            off = [[soon(x) - soon(t) for x, t in zip(of, own)] for of in ([heard[i] for i in away], beside)]
            print(f"2 to 5 ms, {lo} to {hi} Hz: {np.mean(off[0]):+.2f} / {np.mean(off[1]):+.2f} dB", flush=True)
        for sound in a.opinion[1:]:
            dry, dry_rate = sf.read(sound, always_2d=True)
            common = np.gcd(dry_rate, rate)
            dry = signal.resample_poly(dry.mean(1), rate // common, dry_rate // common)[: 6 * rate]

            def convolved(ears, name):
                """Files of what each ear hears of the sound, from 10 ms before the onset on."""
                for ear, r in enumerate(ears[:, max(0, int(onsets(ears).mean()) - rate // 100) :]):
                    x = signal.resample_poly(signal.fftconvolve(dry, r)[: len(dry)], 48000 // np.gcd(48000, rate), rate // np.gcd(48000, rate))
                    sf.write(folder / f"{name}-{ear}.wav", 0.1 * x / np.std(x), 48000, subtype="FLOAT")
                    yield folder / f"{name}-{ear}.wav"

            pairs = []
            for i in away[:: max(1, len(away) // 6)]:
                files = zip(*(convolved(e, f"{n}-{i}") for n, e in (("truth", all_[i]["ears"]), ("scene", heard[i]), ("near", all_[near[i]]["ears"]))))
                pairs += [file for t, s, n in files for file in (t, s, t, n)]
            said = subprocess.run([a.opinion[0], *pairs], check=True, capture_output=True, text=True).stdout.split()
            said = np.array(said, float).reshape(-1, 2).mean(0)
            print(f"predicted opinion of {Path(sound).stem}: {said[0]:.3f} / {said[1]:.3f}", flush=True)


def lessened(a, folder):
    """Errors of what a scene plays within some just noticeable differences against all of it, over one JND, by condition and measure."""
    global SOURCE, PLACE
    about = json.loads(subprocess.run([a.promenade, "inspect", a.scene, "--json"], check=True, capture_output=True).stdout)
    SOURCE, PLACE = np.array(about["emitter_m"]), np.array(about["start_pose"]["position_m"])
    keys, worst, rate = [key for key in JNDS if key != "early"], {}, 48000
    print(f"\n| {Path(a.scene).stem}, JND |" + "|".join(f" {key} " for key in keys) + "|\n|---|" + "---|" * len(keys))
    for name, poses in conditions(a.step).items():
        if name.startswith("every") or a.only not in name:
            continue
        whole, less = [[figures(h, rate) for h in heard_of(a.promenade, a.scene, name, poses, rate, rate, folder, more)[0]] for more in ([], ["--within", a.within])]
        row = {key: abs(np.mean([errors(f, w, key) for f, w in zip(less, whole)])) / JNDS[key] for key in keys}
        worst = {key: max(worst.get(key, 0), value) for key, value in row.items()}
        print(f"| {name} |" + "|".join(f" {value:.2f} " for value in row.values()) + "|", flush=True)
    print("| largest |" + "|".join(f" {value:.2f} " for value in worst.values()) + "|")


def print_table(title, rows, over):
    print(f"\n| {title} |" + "|".join(f" {key} " for key in JNDS) + "|\n|---|" + "---|" * len(JNDS))
    for name, row in rows.items():
        places = lambda key: {"onset": 0, "itd": 0, "direct": 0, "early": 0}.get(key, 2 if key == "coherence" else 1)
        print(f"| {name} |" + "|".join(f" {s:.{places(k)}f} / {n:.{places(k)}f} " for k, (s, n) in row.items()) + "|", flush=True)
        for key, (scene, nearest) in row.items():
            worse = scene > nearest + 1 if key == "early" else abs(scene) > abs(nearest) + 0.1 * JNDS[key]
            if worse and (scene if key == "early" else abs(scene)) > JNDS[key]:
                over.append(f"{title}, {name}: {key} {scene:.2f} (nearest {nearest:.2f})")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("sofa", nargs="?")
    p.add_argument("--t60", default="0.3,0.9,2")
    p.add_argument("--step", type=float, default=10)
    p.add_argument("--only", default="", help="conditions whose names have this")
    p.add_argument("--head", help="heard with this head, which makes the truth too")
    p.add_argument("--turning", help="speeds, degrees a second")
    p.add_argument("--scene", help="one measured around the origin, instead of a made ring")
    p.add_argument("--within", help="just noticeable differences")
    p.add_argument("--measured", help="manifest of a room's responses")
    p.add_argument("--root", help="folder of its files")
    p.add_argument("--steps", default="10,45")
    p.add_argument("--opinion", nargs="+", default=[], help="what visqol.sh builds, and sounds")
    a = p.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        if a.turning:
            return tones(a, folder)
        if a.within:
            return lessened(a, folder)
        if a.measured:
            return left_out(a, folder)
        over = []
        for t60 in map(float, a.t60.split(",")):
            rows, walk = table(a.promenade, a.sofa, t60, a, folder)
            print_table(f"T60 {t60:g} s, every {a.step:g} degrees", rows, over)
            if walk:
                print("walking, 125 Hz to 8 kHz: " + ", ".join(f"{s:.1f} / {n:.1f}" for s, n in walk) + " dB", flush=True)
        print("\nOver one JND and worse than the nearest measurement:\n" + "\n".join(over or ["none"]))


if __name__ == "__main__":
    main()
