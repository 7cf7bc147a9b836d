#!/usr/bin/env python3
"""How true a scene is to the poses that it was baked from, and to each pose that is left out of it.

    poses_truth.py PROMENADE MANIFEST FOLDER [--leave-one-out] [--head FILE.sofa]

PROMENADE is the program, MANIFEST a responses.json whose responses are named by {azimuth} or listed with an azimuth or a pose of the listener
(those of presets/recipes, or what rostock_mat_to_wav.py writes), FOLDER what its file names are in. An impulse is rendered at each measured
pose. Prints, of the scene of all responses, the energy of the difference over that of the measurement in the first 50 ms after the onset, dB,
worst and median pose, with one gain for the whole scene and the lag, whole samples, that fits best. With --leave-one-out each pose is then left
out of a bake of its own, and the means over poses of the magnitudes of errors are printed, of the rendering and of the nearest measurement by
direction: interaural delay (lag of the correlation below 1.5 kHz) and level, T20, C50, level of the first 2.5 ms in thirds of octaves, energy
in thirds of octaves, and in octaves. Needs numpy, scipy and soundfile.
"""
import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import soundfile as sf
from scipy import signal

EARLY_S, LEAD = 0.05, 64
OCTAVES_HZ = (125, 250, 500, 1000, 2000, 4000, 8000)


def measurements(manifest, folder):
    """Name, ears and rate, direction seen from the head (degrees) and distance (metres) of each response, and whether the head turns."""
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
            seen = (math.degrees(math.atan2(dy, dx)) - yaw, math.degrees(math.atan2(dz, math.hypot(dx, dy))))
        else:
            seen, pose = (entry["azimuth_deg"], entry.get("elevation_deg", 0)), None
        distance = entry.get("distance_m", text.get("distance_m", 0))
        out.append({"name": Path(entry["file"]).stem, "ears": samples.T, "rate": rate, "seen": seen, "pose": pose, "distance": distance})
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
    angles = math.atan2(r[1, 0], r[0, 0]), math.asin(np.clip(r[2, 0], -1, 1)), math.atan2(r[2, 1], r[2, 2])
    return (x, 0, 0, *np.degrees(angles))


def onset(ears):
    return min(int(np.argmax(np.abs(e) > 0.1 * np.abs(e).max())) for e in ears)


def early(ears, rate):
    start = onset(ears) - LEAD
    return np.pad(ears, ((0, 0), (max(0, -start), int(EARLY_S * rate) + LEAD)))[:, max(0, start) :][:, : int(EARLY_S * rate) + LEAD]


def lagged(x, lag):
    return np.roll(x, lag, axis=1)


def rendered(promenade, scene, poses, rate, length_s, folder):
    click, out, x = folder / "click.wav", folder / "out.wav", np.zeros(int((length_s + 0.5) * rate))
    x[rate // 4] = 1
    sf.write(click, x, rate, subtype="FLOAT")
    for pose in poses:
        at = "--pose=" + ",".join(f"{v:.6f}" for v in pose)
        subprocess.run([promenade, "render", scene, click, out, at, "--bits", "32f"], check=True, capture_output=True)
        yield sf.read(out, always_2d=True)[0].T


def exactness(measured, heard):
    """Energy of the difference over that of the measurement, dB, pose by pose."""
    rate, pairs = measured[0]["rate"], []
    for m, y in zip(measured, heard):
        want, found = early(m["ears"], rate), early(y, rate)
        lags = range(-40, 41)
        lag = max(lags, key=lambda lag: (want * lagged(found, lag)).sum())
        pairs.append((want, lagged(found, lag)))
    gain = sum((w * f).sum() for w, f in pairs) / sum((f * f).sum() for _, f in pairs)
    return np.array([10 * np.log10(((w - gain * f) ** 2).sum() / (w * w).sum()) for w, f in pairs]), gain


def aligned(ears, length):
    start = onset(ears) - LEAD
    x = np.pad(ears, ((0, 0), (max(0, -start), length)))[:, max(0, start) :]
    return x[:, :length]


def decay(ear, rate):
    left = np.cumsum(ear[::-1] ** 2)[::-1]
    db = 10 * np.log10(left / left[0] + 1e-30)
    first, last = np.argmax(db <= -5), np.argmax(db <= -25)
    return -60 / np.polyfit(np.arange(first, last) / rate, db[first:last], 1)[0] if last > first + 8 else np.nan


def bands_db(x, rate, centres, width):
    power, f = np.abs(np.fft.rfft(x, 1 << 17)) ** 2, np.fft.rfftfreq(1 << 17, 1 / rate)
    edge = 2 ** (0.5 / width)
    centres = [c for c in centres if c * edge < 0.42 * rate]
    return 10 * np.log10(np.array([power[:, (f >= c / edge) & (f < c * edge)].sum(1) for c in centres]) + 1e-20)


def figures(ears, rate):
    low = signal.sosfiltfilt(signal.butter(4, 1500, fs=rate, output="sos"), ears[:, : LEAD + rate // 100], axis=1)
    fine = signal.resample(low, 16 * low.shape[1], axis=1)
    n, reach = fine.shape[1], 16 * rate // 1000
    lags = np.fft.irfft(np.fft.rfft(fine[0], 2 * n) * np.conj(np.fft.rfft(fine[1], 2 * n)))
    lag = np.argmax(np.r_[lags[-reach:], lags[: reach + 1]]) - reach
    thirds = 1000 * 2.0 ** (np.arange(-10, 13) / 3)
    energy = lambda x: (x**2).sum()
    at = LEAD + int(0.05 * rate)
    direct = ears[:, : LEAD + int(0.0025 * rate)] * np.r_[np.ones(LEAD + int(0.002 * rate)), np.linspace(1, 0, LEAD + int(0.0025 * rate) - LEAD - int(0.002 * rate))]
    return {
        "itd us": 1e6 * lag / (16 * rate),
        "ild dB": 10 * np.log10(energy(ears[0]) / energy(ears[1])),
        "t20 %": 100 * np.log(np.nanmean([decay(e[LEAD:], rate) for e in ears])),
        "c50 dB": np.mean([10 * np.log10(energy(e[:at]) / energy(e[at:])) for e in ears]),
        "direct dB": bands_db(direct, rate, thirds[6:], 3),
        "thirds dB": bands_db(ears, rate, thirds, 3),
        **{f"{c} Hz dB": row for c, row in zip(OCTAVES_HZ, bands_db(ears, rate, OCTAVES_HZ, 1))},
    }


def error(found, wanted):
    return {k: float(np.sqrt(np.mean((np.asarray(found[k]) - wanted[k]) ** 2))) for k in wanted}


def unit(seen):
    azimuth, elevation = np.radians(seen)
    return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("promenade")
    p.add_argument("manifest")
    p.add_argument("folder")
    p.add_argument("--leave-one-out", action="store_true")
    p.add_argument("--head", help="as of promenade bake responses")
    a = p.parse_args()
    measured = measurements(a.manifest, a.folder)
    rate = measured[0]["rate"]
    length = max(m["ears"].shape[1] for m in measured)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        scene = folder / "scene.promenade"

        def bake(*options):
            command = [a.promenade, "bake", "responses", a.manifest, "--root", a.folder, "-o", scene, *options]
            command += ["--head", a.head] if a.head else []
            subprocess.run(command, check=True, capture_output=True)

        bake()
        heard = list(rendered(a.promenade, scene, [m["pose"] for m in measured], rate, length / rate, folder))
        exact, gain = exactness(measured, heard)
        worst = int(exact.argmax())
        print(f"{len(measured)} baked poses, first 50 ms: worst {exact.max():.1f} dB ({measured[worst]['name']}), median {np.median(exact):.1f} dB; {scene.stat().st_size / 1e6:.1f} MB")
        if not a.leave_one_out:
            return
        rows = {"render": [], "nearest": []}
        for m in measured:
            bake("--hold-out", f"names={m['name']}")
            (y,) = rendered(a.promenade, scene, [m["pose"]], rate, length / rate, folder)
            # Scenes are normalised to their loudest response: the gain is that of another response, exact in both.
            others = [o for o in measured if o is not m]
            near = max(others, key=lambda o: unit(o["seen"]) @ unit(m["seen"]))
            (known,) = rendered(a.promenade, scene, [near["pose"]], rate, length / rate, folder)
            _, gain = exactness([near], [known])
            wanted = figures(aligned(m["ears"], length), rate)
            rows["render"].append(error(figures(gain * aligned(y, length), rate), wanted))
            rows["nearest"].append(error(figures(aligned(near["ears"], length), rate), wanted))
        for key in rows["render"][0]:
            print(f"{key:10s}" + "".join(f"  {name} {np.nanmean([r[key] for r in rows[name]]):6.2f}" for name in rows))


if __name__ == "__main__":
    main()
