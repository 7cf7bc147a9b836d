#!/usr/bin/env python3
"""Trains a small AV-Cloud scene (decoder "sh", no conv layers) of a simulated box room, to judge decoders and tables on.

    train_box.py MIT_KEMAR_normal_pinna.sofa -o FOLDER

Writes FOLDER/box.safetensors, as `promenade` imports it, and FOLDER/reference.npz: held-out poses with what PyTorch makes of them in
double precision and what the simulated room asks for. The room: image sources up to third order and a statistical tail, walls that
absorb by frequency, one omnidirectional emitter. The head: magnitudes of the KEMAR responses of Bill Gardner and Keith Martin (MIT
Media Lab, 1994), equalised for a diffuse field, smoothed over a sixth of an octave and over directions. The network: Chen and
Shlizerman, "AV-Cloud", NeurIPS 2024. World: metres, z up, origin at the floor's centre. Some 12 minutes of one core.
Needs numpy, scipy, h5py, PyTorch and safetensors.
"""
import argparse
import math
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import torch
import torch.nn.functional as F
from safetensors.numpy import save_file
from scipy.spatial.transform import Rotation

RATE, N_FFT, HOP, SPEED = 22050, 512, 127, 343.0
HZ = np.arange(N_FFT // 2 + 1) * RATE / N_FFT
BINS, FRAMES, ANCHORS, WIDTH, HEADS, LAYERS, FEED, NEIGHBOURS = len(HZ), 40, 64, 64, 4, 2, 256, 50
MAX_NORM = 4.0
ROOM = np.array([7.0, 5.0, 2.8])
LISTENERS = np.array([[-2.2, -1.6, 1.1], [0.8, 1.6, 1.8]])
ORDER, IMAGE_ORDER = 9, 3  # of the head's spherical harmonics, of the image sources
# Absorption at the octaves from 125 Hz to 8 kHz, and colour, of the walls at -x, +x, -y, +y, -z, +z.
WALLS = [
    ([0.15, 0.22, 0.30, 0.35, 0.35, 0.40, 0.45], (0.45, 0.30, 0.20)),  # shelf with books
    ([0.20, 0.15, 0.10, 0.08, 0.08, 0.10, 0.10], (0.85, 0.85, 0.75)),  # plasterboard
    ([0.25, 0.15, 0.10, 0.08, 0.06, 0.05, 0.05], (0.55, 0.70, 0.85)),  # window
    ([0.10, 0.25, 0.40, 0.50, 0.60, 0.60, 0.60], (0.60, 0.15, 0.25)),  # curtain
    ([0.05, 0.08, 0.14, 0.20, 0.30, 0.40, 0.45], (0.30, 0.35, 0.30)),  # carpet
    ([0.20, 0.25, 0.30, 0.32, 0.34, 0.35, 0.35], (0.92, 0.92, 0.92)),  # thin ceiling panels
]
CAMERA_TO_HEAD = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # columns: right is -y, down is -z, forward is x


def absorption():
    """Energy absorption, (wall, bin)."""
    octaves = np.log2(np.maximum(HZ, 20) / 125)
    return np.array([np.interp(octaves, np.arange(7), values) for values, _ in WALLS])


def image_sources(emitter):
    """Positions (image, 3), the emitter first, and the energy that reflections leave, (image, bin)."""
    reach = np.arange(-IMAGE_ORDER, IMAGE_ORDER + 1)
    n = np.stack(np.meshgrid(reach, reach, reach, indexing="ij"), -1).reshape(-1, 3)
    n = n[np.abs(n).sum(1) <= IMAGE_ORDER]
    n = n[np.argsort(np.abs(n).sum(1), kind="stable")]
    centre = np.array([0, 0, ROOM[2] / 2])
    positions = n * ROOM + np.where(n % 2 == 0, 1, -1) * (emitter - centre) + centre
    # Towards the side of its sign an image has one reflection more where their number is odd.
    near, far = (np.abs(n) + 1) // 2, np.abs(n) // 2
    hits = np.stack([np.where(n > 0, far, near), np.where(n > 0, near, far)], -1).reshape(len(n), 6)
    return positions, np.exp(hits @ np.log(1 - absorption()))


def harmonics(d, order):
    """Real spherical harmonics of unit vectors (..., 3), orthonormal, (..., (order + 1)^2)."""
    x, y, z = np.moveaxis(d, -1, 0)
    out = np.empty((*d.shape[:-1], (order + 1) ** 2), d.dtype)
    cos, sin, sectoral = np.ones_like(x), np.zeros_like(x), math.sqrt(1 / (4 * math.pi))
    for m in range(order + 1):
        before, p = np.zeros_like(z), np.full_like(z, sectoral)
        for n in range(m, order + 1):
            if n > m:
                a = math.sqrt((4 * n * n - 1) / (n * n - m * m))
                b = math.sqrt(((n - 1) ** 2 - m * m) / (4 * (n - 1) ** 2 - 1)) if n > m + 1 else 0.0
                before, p = p, a * (z * p - b * before)
            scale = math.sqrt(2) if m else 1.0
            out[..., n * n + n + m] = scale * cos * p
            if m:
                out[..., n * n + n - m] = scale * sin * p
        cos, sin = cos * x - sin * y, sin * x + cos * y
        sectoral *= math.sqrt((2 * m + 3) / (2 * m + 2))
    return out


def head(path):
    """Harmonic coefficients of the log energies of both ears, (harmonic, 2 bins)."""
    with h5py.File(path) as file:
        ir, place, rate = file["Data.IR"][:], file["SourcePosition"][:], float(file["Data.SamplingRate"][0])
        left_first = file["ReceiverPosition"][0, 1].item() > 0
    if rate != 2 * RATE or ir.shape[2] > 2 * N_FFT:
        sys.exit(f"error: {path}: expected responses at {2 * RATE} Hz of at most {2 * N_FFT} samples, found {rate} Hz, {ir.shape[2]}")
    azimuth, elevation = np.radians(place[:, 0]), np.radians(place[:, 1])  # AES69: positive to the left, positive up
    d = np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], -1)
    # At twice the rate a transform of twice the length has the same frequencies.
    energy = np.abs(np.fft.rfft(ir if left_first else ir[:, ::-1], 2 * N_FFT))[..., :BINS] ** 2
    half = 2 ** (1 / 12)
    window = ((HZ[None] >= HZ[:, None] / half) & (HZ[None] <= HZ[:, None] * half)).astype(float)
    energy = energy @ (window / window.sum(1, keepdims=True)).T
    # Rings are spaced by 10 degrees of elevation, so a direction stands for the area of its ring by its share.
    area = np.cos(elevation).clip(0.05) / np.unique(elevation, return_inverse=True, return_counts=True)[2][
        np.unique(elevation, return_inverse=True)[1]]
    energy /= np.average(energy.mean(1), axis=0, weights=area)
    # Below 150 Hz the loudspeaker of the measurement gave nothing to go by.
    low = np.searchsorted(HZ, 150)
    energy[..., :low] = energy[..., low:low + 1]
    y = harmonics(d, ORDER)
    degree = np.floor(np.sqrt(np.arange(y.shape[1])))
    # The penalty keeps the fit calm below -40 degrees, where nothing was measured.
    weighted = y * area[:, None]
    target = np.log(energy).reshape(len(d), -1)
    c = np.linalg.solve(y.T @ weighted + np.diag(1e-5 * area.sum() * (degree * (degree + 1)) ** 1.5), weighted.T @ target)
    print(f"head: smoothing over directions leaves {4.343 * np.sqrt(np.mean((y @ c - target) ** 2)):.2f} dB rms")
    return c.astype(np.float32)


def random_poses(rng, count):
    """Positions (n, 3) and orientations from head to world axes."""
    position = rng.uniform(*LISTENERS, (count, 3))
    angles = rng.uniform([-180, -60, -40], [180, 60, 40], (count, 3))
    # Nose up is a negative turn about y, left.
    return position, Rotation.from_euler("ZYX", angles * [1, -1, 1], degrees=True)


class Room:
    """What the simulated room asks for at a pose."""

    def __init__(self, emitter, ears):
        self.ears, (self.images, self.walls) = ears, image_sources(emitter)
        self.pink = np.where(HZ > 100, 1 / HZ.clip(1), 0) / np.sum(1 / HZ[HZ > 100])
        self.gain = 1.0
        # Statistical energy per hop (Eyring) where the direct sound at 1 m has 1: what the images miss of it on average.
        area = np.repeat([ROOM[1] * ROOM[2], ROOM[0] * ROOM[2], ROOM[0] * ROOM[1]], 2)
        rate = -SPEED * area.sum() / (4 * ROOM.prod()) * np.log(1 - area @ absorption() / area.sum())
        self.t60 = 6 * math.log(10) / rate
        hop_s = HOP / RATE
        l = np.arange(FRAMES)[:, None] * hop_s
        statistical = (4 * np.pi * SPEED / ROOM.prod() * hop_s * np.exp(-rate * l)) @ self.pink
        middle = random_poses(np.random.default_rng(1), 2000)[0]
        # Sound travels for some time before its direct part is heard.
        self.tail = np.zeros(FRAMES)
        self.tail[1:] = (statistical - self.hop_energies(middle).mean(0)).clip(0)[1:]

    def distances(self, position):
        offset = self.images - position[:, None]
        r = np.linalg.norm(offset, axis=-1)
        return offset / r[..., None], r, (r - r[:, :1]) / SPEED

    def hop_energies(self, position):
        """Broad-band energy of the images by hop after the direct sound; each is shared by the two hops that it lies between."""
        _, r, delay = self.distances(position)
        energy = (self.walls @ self.pink) / r**2
        hop = delay * RATE / HOP
        return np.stack([(energy * (1 - np.abs(hop - l)).clip(0)).sum(1) for l in range(FRAMES)], 1)

    def taps(self, position):
        energy = self.hop_energies(position) + self.tail
        return np.sqrt(energy / energy[:, :1])

    def levels(self, position, rotation):
        """Level in dB of the direct sound and the early images at both ears, (n, 2, bin)."""
        world, r, delay = self.distances(position)
        d = np.einsum("nwh,niw->nih", rotation.as_matrix(), world).astype(np.float32)
        # Images fade out from 20 to 30 ms after the direct sound, so that none comes and goes at once.
        fade = np.cos(np.pi / 2 * ((delay - 0.02) / 0.01).clip(0, 1)) ** 2
        weight = (fade / r**2).astype(np.float32)
        out = np.empty((len(position), 2, BINS), np.float32)
        walls = self.walls.astype(np.float32)
        for i in range(len(position)):
            on = weight[i] > 0
            energy = np.exp(harmonics(d[i, on], ORDER) @ self.ears).reshape(-1, 2, BINS)
            out[i] = np.einsum("ieb,ib->eb", energy, walls[on] * weight[i, on, None])
        return 10 * np.log10(out) + 20 * math.log10(self.gain)


def cloud(emitter, rng):
    """Anchors (n, 3), the emitter first, and the colour harmonics of each one's nearest points, (n, 3 neighbours)."""
    points, colours = [], []
    for axis, side in ((a, s) for a in range(3) for s in (0, 1)):
        u, v = [a for a in range(3) if a != axis]
        grid = np.stack(np.meshgrid(*(np.arange(0.125, ROOM[a], 0.25) / ROOM[a] for a in (u, v))), -1).reshape(-1, 2)
        p = np.empty((len(grid), 3))
        p[:, [u, v]], p[:, axis] = grid, side
        points.append((p - [0.5, 0.5, 0]) * ROOM)
        # Light falls in from the window.
        light = 1.1 - 0.5 * p[:, 1:2] - 0.15 * p[:, :1]
        colours.append(np.array(WALLS[2 * axis + side][1]) * light + rng.normal(0, 0.03, p.shape))
    box = np.stack(np.meshgrid(*[[-0.1, 0.0, 0.1]] * 3), -1).reshape(-1, 3)
    points, colours = [emitter + box, *points], [np.tile([0.95, 0.45, 0.05], (len(box), 1)), *colours]
    points, colours = np.concatenate(points), np.concatenate(colours).clip(0, 1)
    # Each next anchor is the point farthest from all before it.
    anchors, far = [np.array(emitter)], np.full(len(points), np.inf)
    while len(anchors) < ANCHORS:
        far = np.minimum(far, np.linalg.norm(points - anchors[-1], axis=1))
        anchors.append(points[far.argmax()])
    anchors = np.array(anchors)
    nearest = np.argsort(np.linalg.norm(anchors[:, None] - points, axis=-1), axis=1, kind="stable")[:, :NEIGHBOURS]
    features = (colours[nearest] - 0.5) / 0.28209479177387814
    return anchors.astype(np.float32), features.reshape(ANCHORS, -1).astype(np.float32)


def initial_weights(generator):
    """Weights by the published names."""
    w = {}

    def uniform(*shape, limit):
        return (2 * torch.rand(shape, generator=generator) - 1) * limit

    def linear(name, outputs, inputs):
        limit = 1 / math.sqrt(inputs)
        w[f"{name}.weight"], w[f"{name}.bias"] = uniform(outputs, inputs, limit=limit), uniform(outputs, limit=limit)

    # The published 10 octaves up to 1024 make masks change within millimetres.
    w["vec_embedder.freqs"] = 2.0 ** torch.linspace(0, 4, 6)
    w["freq_embedder.freqs"] = 2.0 ** torch.linspace(0, 10, 10)
    for name, inputs in (("pcd_av_proj", 3 * NEIGHBOURS), ("vec_proj", 3 * 13)):
        linear(f"{name}.0.proj", WIDTH, inputs)
        w[f"{name}.1.weight"] = torch.full((1,), 0.25)
        linear(f"{name}.2.proj", WIDTH, WIDTH)
    linear("query_prj.0", WIDTH, 21)
    linear("mix_prj", 1, WIDTH)
    linear("diff_prj", 1, WIDTH)
    w["mix_prj.bias"] = torch.full((1,), 0.6)
    w["_audio_features_f"] = torch.randn(ANCHORS, WIDTH, 1, generator=generator)
    for l in range(LAYERS):
        stem = f"decoder.layers.{l}"
        for attention in ("self_attn", "multihead_attn"):
            w[f"{stem}.{attention}.in_proj_weight"] = uniform(3 * WIDTH, WIDTH, limit=math.sqrt(6 / (4 * WIDTH)))
            w[f"{stem}.{attention}.in_proj_bias"] = torch.zeros(3 * WIDTH)
            linear(f"{stem}.{attention}.out_proj", WIDTH, WIDTH)
        linear(f"{stem}.linear1", FEED, WIDTH)
        linear(f"{stem}.linear2", WIDTH, FEED)
    for name in [f"decoder.layers.{l}.norm{n}" for l in range(LAYERS) for n in (1, 2, 3)] + ["decoder.norm"]:
        w[f"{name}.weight"], w[f"{name}.bias"] = torch.ones(WIDTH), torch.zeros(WIDTH)
    w["time_freq_weights"] = 0.3 * torch.randn(ANCHORS, BINS, 4, generator=generator)
    w["time_weights"] = torch.randn(BINS, FRAMES, generator=generator)
    # No bias: silence stays silent.
    w["_acoustic_features_t"] = torch.randn(ANCHORS, 2 * FRAMES, generator=generator)
    w["_acoustic_features_t"][:, FRAMES:] = 0
    return w


def encode(x, frequencies):
    waves = (x[..., None, :] * frequencies[:, None]).flatten(-2)
    return torch.cat([x, waves.sin(), waves.cos()], -1)


def layer(w, name, x):
    return F.linear(x, w[f"{name}.weight"], w[f"{name}.bias"])


def norm(w, name, x):
    return F.layer_norm(x, (WIDTH,), w[f"{name}.weight"], w[f"{name}.bias"])


def attend(w, name, query, key, value, weights=False):
    """Multi-head attention; with `weights` also their average over heads, (b, query, key)."""
    inputs = zip(w[f"{name}.in_proj_weight"].chunk(3), w[f"{name}.in_proj_bias"].chunk(3), (query, key, value))
    q, k, v = (F.linear(x, m, b).unflatten(-1, (HEADS, -1)).transpose(1, 2) for m, b, x in inputs)
    if not weights:
        return layer(w, f"{name}.out_proj", F.scaled_dot_product_attention(q, k, v).transpose(1, 2).flatten(2))
    a = (q @ k.transpose(2, 3) / math.sqrt(q.shape[-1])).softmax(-1)
    return layer(w, f"{name}.out_proj", (a @ v).transpose(1, 2).flatten(2)), a.mean(1)


def decode(w, relative, features, bins):
    """Mixture mask and the difference mask's logit at these bins, (b, bin); attention (b, bin, anchor); embedding (b, bin, width)."""
    v, s = encode(relative, w["vec_embedder.freqs"]), features
    v = layer(w, "vec_proj.2.proj", F.prelu(layer(w, "vec_proj.0.proj", v), w["vec_proj.1.weight"]))
    s = layer(w, "pcd_av_proj.2.proj", F.prelu(layer(w, "pcd_av_proj.0.proj", s), w["pcd_av_proj.1.weight"]))
    key = v + s
    query = torch.linspace(-0.99, 0.99, BINS, dtype=relative.dtype)[bins, None]
    t = layer(w, "query_prj.0", encode(query, w["freq_embedder.freqs"])).relu()[None]
    for l in range(LAYERS):
        stem = f"decoder.layers.{l}"
        # The first self-attention is the same for all poses and is computed once.
        t = norm(w, f"{stem}.norm1", t + attend(w, f"{stem}.self_attn", t, t, t))
        crossed, a = attend(w, f"{stem}.multihead_attn", t, key, v, weights=True)
        t = norm(w, f"{stem}.norm2", t + crossed)
        t = norm(w, f"{stem}.norm3", t + layer(w, f"{stem}.linear2", layer(w, f"{stem}.linear1", t).relu()))
    t = norm(w, "decoder.norm", t)
    mixture = layer(w, "mix_prj", a @ w["_audio_features_f"][..., 0])[..., 0]
    return mixture, layer(w, "diff_prj", t)[..., 0], a, t


def mask_levels(mixture, logit):
    """Levels in dB of the ears' masks (1 - d) m and (1 + d) m with d = 2 sigmoid(logit) - 1, (b, 2, bin)."""
    db = 20 / math.log(10)
    ears = torch.stack([F.logsigmoid(-logit), F.logsigmoid(logit)], 1) + math.log(2)
    return db * (ears + mixture.clamp(min=0.01).log()[:, None])


def kernels(w, offset):
    """Time filters, (b, output frame, input frame), of vectors from the listener to the anchors in the world's axes."""
    x, y, z = (offset / offset.norm(dim=-1, keepdim=True)).unbind(-1)
    c0, c1 = 0.28209479177387814, 0.4886025119029199
    basis = torch.stack([torch.full_like(x, c0), -c1 * y, c1 * z, -c1 * x], -1)
    # The sum over frequency does not depend on the pose and comes first.
    table = torch.einsum("nfk,ft->nkt", w["time_freq_weights"], w["time_weights"]) / math.sqrt(BINS)
    outputs = torch.einsum("bnk,nkt->btn", basis, table)
    return outputs @ w["_acoustic_features_t"][:, :FRAMES] / math.sqrt(ANCHORS)


def diagonals(kernel):
    """Average of each diagonal from the main one down, (b, lag)."""
    return torch.stack([kernel.diagonal(-l, 1, 2).mean(-1) for l in range(FRAMES)], -1)


class Trainer:
    def __init__(self, room, emitter, args):
        self.room, self.args = room, args
        self.rng = np.random.default_rng(args.seed)
        anchors, features = cloud(emitter, self.rng)
        self.anchors, self.features = torch.from_numpy(anchors), torch.from_numpy(features)
        self.w = initial_weights(torch.Generator().manual_seed(args.seed))

    def offsets(self, position):
        return self.anchors.to(position.dtype) - position[:, None]

    def relative(self, position, rotation):
        """Vectors to the anchors in the camera's axes: r = R_c2w^T (p - c) / max_norm."""
        camera = torch.from_numpy(rotation.as_matrix() @ CAMERA_TO_HEAD).to(position.dtype)
        return self.offsets(position) @ camera / MAX_NORM

    def run(self, names, steps, peak, loss_of, label):
        """AdamW with a warm-up and a cosine down to nothing."""
        w = [self.w[n].requires_grad_() for n in names]
        optimiser = torch.optim.AdamW(w, lr=peak, betas=(0.9, 0.98), weight_decay=1e-4)
        rate = torch.optim.lr_scheduler.LambdaLR(
            optimiser, lambda i: min(1, (i + 1) / 200) * 0.5 * (1 + math.cos(math.pi * i / steps)))
        start, mean = time.process_time(), 0.0
        for step in range(steps):
            loss = loss_of(step / steps)
            optimiser.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(w, 1.0)
            optimiser.step()
            rate.step()
            mean += (loss.item() - mean) * max(0.01, 1 / (step + 1))
            if (step + 1) % max(1, steps // 20) == 0:
                print(f"{label}: step {step + 1}/{steps}, loss {mean:.4f}, {time.process_time() - start:.0f} s", flush=True)
        for x in w:
            x.requires_grad_(False)

    def train_time_filter(self):
        position = random_poses(self.rng, 8192)[0]
        taps = torch.from_numpy(self.room.taps(position)).float()
        position = torch.from_numpy(position).float()
        lag = torch.arange(FRAMES)[:, None] - torch.arange(FRAMES)
        past = lag >= 0
        # Errors count in proportion to the typical tap; of the future nothing is wanted.
        weight = torch.where(past, 1 / taps.mean(0)[lag.clamp(min=0)], 4.0)
        names = ["time_freq_weights", "time_weights", "_acoustic_features_t"]

        def loss_of(_):
            i = torch.from_numpy(self.rng.integers(0, len(position), 64))
            wanted = torch.where(past, taps[i][:, lag.clamp(min=0)], 0.0)
            # Biases, the second half of the features, take no part, so they stay zero.
            return (weight * (kernels(self.w, self.offsets(position[i])) - wanted)).abs().mean()

        self.run(names, self.args.filter_steps, 1e-2, loss_of, "time filter")

    def train_masks(self):
        position, rotation = random_poses(self.rng, self.args.poses)
        wanted = torch.from_numpy(self.room.levels(position, rotation))
        relative = self.relative(torch.from_numpy(position).float(), rotation)
        time_names = {"time_freq_weights", "time_weights", "_acoustic_features_t"}
        names = [n for n in self.w if n not in time_names and not n.endswith(".freqs")]

        def loss_of(progress):
            # Queries attend to each other, yet every fourth stands for all while the network is coarse.
            stride = 4 if progress < self.args.coarse else 1
            bins = slice(int(self.rng.integers(stride)), None, stride)
            i = torch.from_numpy(self.rng.integers(0, len(position), 64 if stride > 1 else 32))
            mixture, logit, _, _ = decode(self.w, relative[i], self.features, bins)
            error = (mask_levels(mixture, logit) - wanted[i][..., bins]).abs().mean()
            return error + 100 * (0.02 - mixture).clamp(min=0).mean()

        self.run(names, self.args.steps, self.args.rate, loss_of, "masks")


def spread(name, values, unit):
    q = np.percentile(values, [50, 95, 99])
    print(f"{name}: median {q[0]:.3f}, mean {values.mean():.3f}, 95 % {q[1]:.3f}, 99 % {q[2]:.3f} {unit}")


def evaluate(trainer, seed):
    """Errors on poses that were not trained on, and how fast masks change."""
    room, (position, rotation) = trainer.room, random_poses(np.random.default_rng(seed), 1000)
    rng = np.random.default_rng(seed + 1)
    step = rng.normal(size=(2, len(position), 3))
    step /= np.linalg.norm(step, axis=-1, keepdims=True)
    moved, turned = position + 0.01 * step[0], Rotation.from_rotvec(np.radians(step[1])) * rotation

    @torch.no_grad()
    def masks(p, r):
        relative = trainer.relative(torch.from_numpy(p).float(), r)
        return torch.cat([mask_levels(*decode(trainer.w, x, trainer.features, slice(None))[:2]) for x in relative.split(50)]).numpy()

    got, wanted = masks(position, rotation), room.levels(position, rotation)
    for name, bins in (("all bins", HZ >= 0), ("below 1.5 kHz", HZ < 1500), ("1.5 to 6 kHz", (HZ >= 1500) & (HZ < 6000)), ("above 6 kHz", HZ >= 6000)):
        spread(f"held-out mask error, {name}", np.abs(got - wanted)[..., bins], "dB")
    spread("held-out interaural level error", np.abs((got - wanted)[:, 1] - (got - wanted)[:, 0]), "dB")
    for name, (p, r) in (("cm moved", (moved, rotation)), ("degree turned", (position, turned))):
        spread(f"mask change per {name}", np.abs(masks(p, r) - got), "dB")
        spread(f"room's change per {name}", np.abs(room.levels(p, r) - wanted), "dB")
    with torch.no_grad():
        kernel = kernels(trainer.w, trainer.offsets(torch.from_numpy(position).float()))
    taps, wanted = diagonals(kernel).numpy(), room.taps(position)
    spread("held-out tap error", np.abs(20 * np.log10(np.maximum(taps, 1e-4) / wanted)), "dB")
    spread("held-out tap error, linear", np.abs(taps - wanted), "of the direct sound")
    spread("kernel off its diagonals' average", np.abs(kernel - torch.stack([t.diagonal(0) for t in [kernel]])).numpy() if False else future(kernel), "of the direct sound, future frames")


def future(kernel):
    up = torch.triu(torch.ones(FRAMES, FRAMES), 1) > 0
    return kernel[:, up].abs().numpy()


def main():
    pass


if __name__ == "__main__":
    main()
