#!/usr/bin/env python3
"""Trains a small AV-Cloud scene (decoder "sh", no conv layers) of a simulated box room, to judge decoders and tables on.

    train_box.py MIT_KEMAR_normal_pinna.sofa -o FOLDER

Writes FOLDER/box.safetensors, as `promenade` imports it, and FOLDER/reference.npz: poses that were not trained on, what PyTorch makes
of them, and what the simulated room asks for. The room: image sources up to third order and a statistical tail, walls that absorb by
frequency, an omnidirectional emitter. The head: magnitudes of the KEMAR responses of Bill Gardner and Keith Martin (MIT Media Lab,
1994), equalised for a diffuse field, smoothed over 1/6 octave and over directions. The network: Chen and Shlizerman, "AV-Cloud",
NeurIPS 2024. World: metres, z up, origin at the floor's centre. Takes some 10 minutes of one core; the same each time on one machine.
Needs numpy, scipy, h5py, PyTorch and safetensors.
"""
import argparse
import copy
import math
import os
import sys
import time
from collections import OrderedDict
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")  # read when numpy is first imported

import h5py
import numpy as np
import torch
from safetensors.numpy import save_file
from scipy.spatial.transform import Rotation
from torch import nn
from torch.nn import functional as F

RATE, N_FFT, HOP, SPEED = 22050, 512, 127, 343.0
HZ = np.arange(N_FFT // 2 + 1) * RATE / N_FFT
BINS, FRAMES, ANCHORS, WIDTH, HEADS, LAYERS, FEED, NEIGHBOURS = len(HZ), 40, 64, 64, 4, 2, 256, 50
MAX_NORM, LEAST_MASK, BATCH = 4.0, 0.01, 64
EARLY = math.ceil(0.025 * RATE / HOP)  # hops that belong to the mask
TIME_FILTER = ("time_freq_weights", "time_weights", "_acoustic_features_t")
CAMERA_TO_HEAD = np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]])  # columns: right is -y, down is -z, forward is x
ROOM, CENTRE, LISTENERS = np.array([7.0, 5.0, 2.8]), np.array([0, 0, 1.4]), np.array([[-2.2, -1.6, 1.1], [0.8, 1.6, 1.8]])
# Absorption at the octaves from 125 Hz to 8 kHz, and colour, of the walls at -x, +x, -y, +y, -z, +z.
WALLS = [
    ([0.15, 0.22, 0.30, 0.35, 0.35, 0.40, 0.45], (0.45, 0.30, 0.20)),  # shelf with books
    ([0.20, 0.15, 0.10, 0.08, 0.08, 0.10, 0.10], (0.85, 0.85, 0.75)),  # plasterboard
    ([0.25, 0.15, 0.10, 0.08, 0.06, 0.05, 0.05], (0.55, 0.70, 0.85)),  # window
    ([0.10, 0.25, 0.40, 0.50, 0.60, 0.60, 0.60], (0.60, 0.15, 0.25)),  # curtain
    ([0.05, 0.08, 0.14, 0.20, 0.30, 0.40, 0.45], (0.30, 0.35, 0.30)),  # carpet
    ([0.20, 0.25, 0.30, 0.32, 0.34, 0.35, 0.35], (0.92, 0.92, 0.92)),  # thin ceiling panels
]
ABSORPTION = np.array([np.interp(np.log2(HZ.clip(20) / 125), np.arange(7), values) for values, _ in WALLS])


def bumps(d, count=220, sharpness=14.0):
    """Smooth functions of unit vectors (..., 3), each about one of `count` directions spread over the sphere, (..., count)."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, math.pi * (1 + math.sqrt(5)) * i
    centres = np.stack([np.cos(turn) * np.sqrt(1 - z * z), np.sin(turn) * np.sqrt(1 - z * z), z], -1).astype(d.dtype)
    return np.exp(sharpness * (d @ centres.T - 1))


def head(path):
    """Weights of the bumps that sum to the log energies at both ears, (bump, 2 bins)."""
    with h5py.File(path) as file:
        ir, place, rate = file["Data.IR"][:], np.radians(file["SourcePosition"][:, :2]), file["Data.SamplingRate"][0]
        left_first = file["ReceiverPosition"][0, 1].item() > 0
    if rate != 2 * RATE or ir.shape[2] > 2 * N_FFT:
        sys.exit(f"error: {path}: expected at most {2 * N_FFT} samples at {2 * RATE} Hz, found {ir.shape[2]} at {rate} Hz")
    azimuth, elevation = place.T  # AES69: positive to the left, positive up
    d = np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], -1)
    # At twice the rate a transform of twice the length has the same frequencies.
    energy = np.abs(np.fft.rfft(ir if left_first else ir[:, ::-1], 2 * N_FFT))[..., :BINS] ** 2
    window = np.abs(np.log2(HZ.clip(1) / HZ.clip(1)[:, None])) <= 1 / 12
    energy = energy @ (window / window.sum(1, keepdims=True)).T
    # The directions lie on rings of 10 degrees of elevation: each stands for its share of its ring's area.
    _, ring, count = np.unique(elevation, return_inverse=True, return_counts=True)
    area = np.cos(elevation).clip(0.05) / count[ring]
    energy /= np.average(energy.mean(1), axis=0, weights=area)
    # Below 150 Hz the loudspeaker of the measurement gave nothing to go by.
    energy[..., HZ < 150] = energy[..., [np.searchsorted(HZ, 150)]]
    # The penalty keeps the sum calm where nothing was measured, below -40 degrees, and lets it fall back to the diffuse field.
    y, target = bumps(d), np.log(energy).reshape(len(d), -1)
    weights = np.linalg.solve(y.T @ (y * area[:, None]) + 1e-3 * area.sum() * np.eye(y.shape[1]), (y * area[:, None]).T @ target)
    print(f"head: smoothing over directions leaves {4.343 * np.sqrt(np.mean((y @ weights - target) ** 2)):.2f} dB rms")
    return weights.astype(np.float32)


def random_poses(rng, count):
    """Positions (n, 3) and orientations from head to world axes."""
    angles = rng.uniform([-180, -60, -40], [180, 60, 40], (count, 3)) * [1, -1, 1]  # nose up is a negative turn about y, left
    return rng.uniform(*LISTENERS, (count, 3)), Rotation.from_euler("ZYX", angles, degrees=True)


class Room:
    """What the simulated room asks for at a pose."""

    def __init__(self, emitter, ears, order=3):
        n = np.indices([2 * order + 1] * 3).reshape(3, -1).T - order
        n = n[np.argsort(np.abs(n).sum(1), kind="stable")]  # the emitter first
        n = n[np.abs(n).sum(1) <= order]
        self.ears, self.images = ears, n * ROOM + np.where(n % 2 == 0, 1, -1) * (emitter - CENTRE) + CENTRE
        # Beyond an odd number of walls an image has met the one on its own side once more than the opposite one.
        hits = np.stack([(np.abs(n) + (n < 0)) // 2, (np.abs(n) + (n > 0)) // 2], -1).reshape(len(n), 6)
        self.left = np.exp(hits @ np.log(1 - ABSORPTION))  # of the energy, (image, bin)
        # The same energy in each octave above 100 Hz.
        self.pink = np.where(HZ > 100, 1 / HZ.clip(1), 0) / (1 / HZ[HZ > 100]).sum()
        position, rotation = random_poses(np.random.default_rng(1), 20000)
        # Eyring's decay per second, and the statistical energy of each hop where the direct sound at 1 m has 1.
        area = np.repeat(ROOM.prod() / ROOM, 2)
        decay = -SPEED * area.sum() / (4 * ROOM.prod()) * np.log(1 - area @ ABSORPTION / area.sum())
        statistical = 4 * np.pi * SPEED / ROOM.prod() * HOP / RATE * np.exp(-decay * HOP / RATE * np.arange(FRAMES)[:, None]) @ self.pink
        # The tail is what the images miss of that on average. Images of the next order begin some 24 ms after the direct sound.
        self.tail = np.where(np.arange(FRAMES) > order, (statistical - self.hop_energies(position[:2000]).mean(0)).clip(0), 0)
        # The mixture mask is to be 1 at 1 m.
        self.gain_db, near = 0.0, np.argsort(np.abs(np.linalg.norm(position - emitter, axis=1) - 1))[:300]
        self.gain_db = -20 * np.log10((10 ** (self.levels(position[near], rotation[near]) / 20)).mean(1)).mean()
        print("reverberation time at 125, 1000, 4000 Hz:", (6 * math.log(10) / np.interp([125, 1000, 4000], HZ, decay)).round(2), "s")

    def hop_energies(self, position):
        """Broad-band energy of the images by hop after the direct sound; each is shared by the two hops that it lies between."""
        r = np.linalg.norm(self.images - position[:, None], axis=-1)
        energy, hop = self.left @ self.pink / r**2, (r - r[:, :1]) / SPEED * RATE / HOP
        return np.stack([(energy * (1 - np.abs(hop - l)).clip(0)).sum(1) for l in range(FRAMES)], 1)

    def taps(self, position):
        """Taps on magnitudes, of the mask, by lag: a steady sound that stops dies away with them as the room's energy does.

        What arrives within 25 ms is in the mask; the taps from lag l on add up to the root of the energy from there on (Schroeder 1965).
        """
        energy = self.hop_energies(position) + self.tail
        late = np.where(np.arange(FRAMES) >= EARLY, energy, 0) / energy[:, :EARLY].sum(1, keepdims=True)
        rest = np.sqrt(late[:, ::-1].cumsum(1)[:, ::-1])
        return rest - np.pad(rest[:, 1:], ((0, 0), (0, 1)))

    def levels(self, position, rotation):
        """Level in dB of the direct sound and the early images at both ears, (n, 2, bin)."""
        offset = self.images - position[:, None]
        r = np.linalg.norm(offset, axis=-1)
        delay, d = (r - r[:, :1]) / SPEED, (offset / r[..., None] @ rotation.as_matrix()).astype(np.float32)
        # Images fade out from 20 to 30 ms after the direct sound, so that none comes and goes at once.
        weight = (np.cos(np.pi / 2 * ((delay - 0.02) / 0.01).clip(0, 1)) ** 2 / r**2).astype(np.float32)
        left, out = np.tile(self.left, 2).astype(np.float32), np.empty((len(position), 2 * BINS), np.float32)
        for i, on in enumerate(weight > 1e-9):
            out[i] = (np.exp(bumps(d[i, on]) @ self.ears) * left[on] * weight[i, on, None]).sum(0)
        return 10 * np.log10(out.reshape(-1, 2, BINS)) + self.gain_db


def cloud(emitter, rng):
    """Anchors (n, 3), the emitter first, and the colour harmonics of each one's nearest points, (n, 3 neighbours)."""
    # A loudspeaker, then the walls in a grid of 0.25 m.
    points = [emitter + 0.1 * (np.indices([3] * 3).reshape(3, -1).T - 1)]
    colours = [np.tile([0.95, 0.45, 0.05], (len(points[0]), 1))]
    for wall, (_, colour) in enumerate(WALLS):
        axis, side = divmod(wall, 2)
        grids = [[side] if a == axis else np.arange(0.125, ROOM[a], 0.25) / ROOM[a] for a in range(3)]
        p = np.stack(np.meshgrid(*grids, indexing="ij"), -1).reshape(-1, 3)
        points.append((p - [0.5, 0.5, 0]) * ROOM)
        # Light falls in from the window.
        colours.append(np.array(colour) * (1.1 - 0.5 * p[:, 1:2] - 0.15 * p[:, :1]) + rng.normal(0, 0.03, p.shape))
    points, colours = np.concatenate(points), (np.concatenate(colours).clip(0, 1) - 0.5) / 0.28209479177387814
    # Each next anchor is the point farthest from all before it.
    anchors, far = [emitter], np.full(len(points), np.inf)
    while len(anchors) < ANCHORS:
        far = np.minimum(far, np.linalg.norm(points - anchors[-1], axis=1))
        anchors.append(points[far.argmax()])
    nearest = np.argsort(np.linalg.norm(np.array(anchors)[:, None] - points, axis=-1), axis=1, kind="stable")[:, :NEIGHBOURS]
    return np.array(anchors, np.float32), colours[nearest].reshape(ANCHORS, -1).astype(np.float32)


def projection(inputs):
    first, second = (nn.Sequential(OrderedDict(proj=nn.Linear(n, WIDTH))) for n in (inputs, WIDTH))
    return nn.Sequential(first, nn.PReLU(), second)


def encode(x, embedder):
    waves = (x[..., None, :] * embedder.freqs[:, None]).flatten(-2)
    return torch.cat([x, waves.sin(), waves.cos()], -1)


class Layer(nn.Module):
    """Self-attention over frequencies, cross-attention to anchors, two dense layers, each added and normalised."""

    def __init__(self):
        super().__init__()
        self.self_attn, self.multihead_attn = (nn.MultiheadAttention(WIDTH, HEADS, batch_first=True) for _ in range(2))
        self.linear1, self.linear2 = nn.Linear(WIDTH, FEED), nn.Linear(FEED, WIDTH)
        self.norm1, self.norm2, self.norm3 = (nn.LayerNorm(WIDTH) for _ in range(3))

    def forward(self, t, key, value):
        # Before the first anchors come in, one computation does for all poses.
        t = self.norm1(t + self.self_attn(t, t, t, need_weights=False)[0]).expand(len(key), -1, -1)
        crossed, attention = self.multihead_attn(t, key, value)
        t = self.norm2(t + crossed)
        return self.norm3(t + self.linear2(self.linear1(t).relu())), attention


class Cloud(nn.Module):
    """AV-Cloud "sh" without conv layers; its state dict has the published names."""

    def __init__(self, anchors, features):
        super().__init__()
        self.register_buffer("anchors", anchors, persistent=False)
        self.register_buffer("features", features, persistent=False)
        # The published 10 octaves of relative vectors, up to 1024, make masks change within millimetres.
        self.vec_embedder, self.freq_embedder = nn.Module(), nn.Module()
        self.vec_embedder.register_buffer("freqs", 2.0 ** torch.linspace(0, 4, 6))
        self.freq_embedder.register_buffer("freqs", 2.0 ** torch.linspace(0, 10, 10))
        self.pcd_av_proj, self.vec_proj, self.query_prj = projection(3 * NEIGHBOURS), projection(39), nn.Sequential(nn.Linear(21, WIDTH))
        self.decoder = nn.ModuleDict({"layers": nn.ModuleList(Layer() for _ in range(LAYERS)), "norm": nn.LayerNorm(WIDTH)})
        self.mix_prj, self.diff_prj = nn.Linear(WIDTH, 1), nn.Linear(WIDTH, 1)
        self.mix_prj.bias.data.fill_(0.6)
        self._audio_features_f = nn.Parameter(torch.randn(ANCHORS, WIDTH, 1))
        self.time_freq_weights = nn.Parameter(0.3 * torch.randn(ANCHORS, BINS, 4))
        self.time_weights = nn.Parameter(torch.randn(BINS, FRAMES))
        # The half that makes biases is zero and stays so: silence in, silence out.
        self._acoustic_features_t = nn.Parameter(torch.cat([torch.randn(ANCHORS, FRAMES), torch.zeros(ANCHORS, FRAMES)], 1))

    def forward(self, position, rotation, bins=slice(None)):
        """Mixture mask and the difference mask's logit, (b, bin); attention (b, bin, anchor); embedding (b, bin, width)."""
        camera = torch.from_numpy(rotation.as_matrix() @ CAMERA_TO_HEAD).to(position.dtype)
        # Vectors to the anchors in the camera's axes: R_c2w^T (p - c) / max_norm.
        value = self.vec_proj(encode((self.anchors - position[:, None]) @ camera / MAX_NORM, self.vec_embedder))
        key = value + self.pcd_av_proj(self.features)
        t = self.query_prj(encode(torch.linspace(-0.99, 0.99, BINS).to(position.dtype)[bins, None], self.freq_embedder)).relu()[None]
        for layer in self.decoder["layers"]:
            t, a = layer(t, key, value)
        t = self.decoder["norm"](t)
        return self.mix_prj(a @ self._audio_features_f[..., 0])[..., 0], self.diff_prj(t)[..., 0], a, t

    def kernels(self, position):
        """Time filters, (b, output frame, input frame), and the averages of their diagonals from the main one down, (b, lag)."""
        x, y, z = F.normalize(self.anchors - position[:, None], dim=-1).unbind(-1)
        basis = torch.stack([torch.full_like(x, 0.28209479177387814), *(0.4886025119029199 * c for c in (-y, z, -x))], -1)
        # The sum over frequency does not depend on the pose and comes first.
        table = torch.einsum("nfk,ft->nkt", self.time_freq_weights, self.time_weights) / math.sqrt(BINS)
        kernel = torch.einsum("bnk,nkt->btn", basis, table) @ self._acoustic_features_t[:, :FRAMES] / math.sqrt(ANCHORS)
        return kernel, torch.stack([kernel.diagonal(-l, 1, 2).mean(-1) for l in range(FRAMES)], -1)


def mask_levels(mixture, logit, *_):
    """Levels in dB of the ears' masks (1 - d) m and (1 + d) m with d = 2 sigmoid(logit) - 1, (b, 2, bin)."""
    ears = torch.stack([F.logsigmoid(-logit), F.logsigmoid(logit)], 1) + math.log(2)
    return 20 / math.log(10) * (ears + mixture.clamp(min=LEAST_MASK).log()[:, None])


def train(parameters, steps, peak, loss_of):
    """AdamW with a warm-up and a cosine down to nothing."""
    optimiser = torch.optim.AdamW(parameters, lr=peak, betas=(0.9, 0.98), weight_decay=1e-4)
    cosine = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda i: min(1, i / 200) * (0.5 + 0.5 * math.cos(math.pi * i / steps)))
    for step in range(1, steps + 1):
        loss = loss_of(step / steps)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        optimiser.step()
        cosine.step()
        if step % max(1, steps // 10) == 0:
            print(f"step {step} of {steps}, loss {loss.item():.4f}, {time.process_time():.0f} s of processor time", flush=True)


def train_time_filter(model, room, rng, steps=5000):
    position = random_poses(rng, 8192)[0]
    taps, position = (torch.from_numpy(x).float() for x in (room.taps(position), position))
    lag = torch.arange(FRAMES)[:, None] - torch.arange(FRAMES)
    # The kernel is to have the taps on its diagonals and nothing of the future or the present. Small taps weigh more.
    weight = torch.where(lag > 0, (taps.mean(0) + 0.005)[lag.clamp(min=0)] ** -0.7, 4.0)

    def loss_of(_):
        i = rng.integers(0, len(position), BATCH)
        wanted = torch.where(lag >= 0, taps[i][:, lag.clamp(min=0)], 0.0)
        return (weight * (model.kernels(position[i])[0] - wanted)).square().mean()

    train([p for n, p in model.named_parameters() if n in TIME_FILTER], steps, 2e-2, loss_of)


def train_masks(model, room, rng, steps):
    position, rotation = random_poses(rng, 60000)
    wanted, position = torch.from_numpy(room.levels(position, rotation)), torch.from_numpy(position).float()

    def loss_of(progress):
        # Queries attend to each other, yet while the network is coarse every fourth stands for all of them.
        bins = slice(int(rng.integers(4)), None, 4) if progress < 0.9 else slice(None)
        i = rng.integers(0, len(position), BATCH)
        masks = model(position[i], rotation[i], bins)
        # Below the least mask the logarithm has no slope; the penalty has one.
        return (mask_levels(*masks) - wanted[i][..., bins]).abs().mean() + 100 * (2 * LEAST_MASK - masks[0]).clamp(min=0).mean()

    train([p for n, p in model.named_parameters() if n not in TIME_FILTER], steps, 2e-3, loss_of)


@torch.no_grad()
def evaluate(model, room, rng):
    """Errors on poses that were not trained on, and how fast masks change."""
    def spread(name, values, unit="dB"):
        values = np.abs(values)
        print(f"{name}: mean {values.mean():.3f}, 50, 95, 99 %", np.percentile(values, [50, 95, 99]).round(3), unit)

    def masks(p, r):
        p = torch.from_numpy(p).float()
        return np.concatenate([mask_levels(*model(p[i], r[i])) for i in np.array_split(np.arange(len(p)), 20)])

    position, rotation = random_poses(rng, 1000)
    step, turn = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, len(position), 3)))
    turned = Rotation.from_rotvec(np.radians(turn)) * rotation
    got, wanted = masks(position, rotation), room.levels(position, rotation)
    for low, high in ((0, RATE // 2), (0, 1500), (1500, 6000), (6000, RATE // 2)):
        spread(f"mask error, {low} to {high} Hz", (got - wanted)[..., (HZ >= low) & (HZ <= high)])
    spread("error of the level difference between ears", np.diff(got - wanted, axis=1))
    for name, p, r in (("cm moved", position + 0.01 * step, rotation), ("degree turned", position, turned)):
        spread(f"mask change per {name}", masks(p, r) - got)
        spread(f"the room's change per {name}", room.levels(p, r) - wanted)
    (kernel, taps), wanted = model.kernels(torch.from_numpy(position).float()), room.taps(position)
    heard = wanted.mean(0) > 0
    spread("tap error", 20 * np.log10(taps.numpy().clip(1e-4) / wanted.clip(1e-4))[:, heard])
    spread("tap error", taps.numpy() - wanted, "of the mask")
    spread("kernel's future frames", kernel[:, torch.ones(FRAMES, FRAMES).triu(1) > 0].numpy(), "of the mask")


@torch.no_grad()
def save(model, room, emitter, poses, folder):
    arrays = {"anchors.position": model.anchors, "anchors.features": model.features, **model.state_dict()}
    metadata = {"kind": "sh", "convention": "physical", "max_norm": MAX_NORM, "sample_rate": RATE, "n_fft": N_FFT, "hop": HOP,
                "heads": HEADS, "emitter": list(emitter), "credit": "KEMAR responses: Gardner and Martin, MIT Media Lab, 1994"}
    save_file({k: v.contiguous().numpy() for k, v in arrays.items()}, folder / "box.safetensors", {k: str(v) for k, v in metadata.items()})
    # In double precision, at poses rounded to single.
    position, quaternion = poses[0].astype(np.float32), poses[1].as_quat(scalar_first=True).astype(np.float32)
    rotation, exact = Rotation.from_quat(quaternion, scalar_first=True), copy.deepcopy(model).double()
    mixture, logit, attention, embedding = exact(torch.from_numpy(position).double(), rotation)
    kernel, taps = exact.kernels(torch.from_numpy(position).double())
    left, right = 10 ** (room.levels(position, rotation).swapaxes(0, 1) / 20)
    np.savez(folder / "reference.npz", position=position, quaternion_wxyz=quaternion, mixture=mixture, difference=torch.tanh(logit / 2),
             embedding=embedding.float(), attention=attention.mean(1), attention_sum=attention.sum(2), kernel=kernel,
             taps=taps, target_left=left, target_right=right, target_taps=room.taps(position))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sofa", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder")
    parser.add_argument("--emitter", type=float, nargs=3, default=(1.5, 0.8, 1.4), help="metres")
    parser.add_argument("--steps", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    emitter = np.array(args.emitter)
    if (np.abs(emitter - CENTRE) >= ROOM / 2).any() or ((emitter >= LISTENERS[0]) & (emitter <= LISTENERS[1])).all():
        sys.exit(f"error: expected an emitter in the room and not among the listeners, found {emitter}")
    args.output.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)
    torch.manual_seed(args.seed)
    rng, unseen = (np.random.default_rng(args.seed + n) for n in (0, 1000))
    room, model = Room(emitter, head(args.sofa)), Cloud(*map(torch.from_numpy, cloud(emitter, rng)))
    train_time_filter(model, room, rng)
    train_masks(model, room, rng, args.steps)
    evaluate(model, room, unseen)
    save(model, room, args.emitter, random_poses(unseen, 20), args.output)


if __name__ == "__main__":
    main()
