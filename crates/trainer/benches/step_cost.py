#!/usr/bin/env python3
"""Times a step of PyTorch on what step_cost.rs trains in its second and its fourth row: forward, backward, AdamW, batches of 6 listeners.

The first figure is the network alone. The second adds AV-Cloud's render head with time filters from spherical harmonics of the first
degree and convolution layers, on the magnitudes of one-second clips (173 frames, 257 bins) for both ears. Transforms and a loss over
waveforms are left out, so PyTorch has less to do. Needs PyTorch. Usage: step_cost.py [THREADS]
"""
import statistics
import sys
import time

import torch
from torch import nn

THREADS = int(sys.argv[1]) if len(sys.argv) > 1 else 1
BATCH, ANCHORS, BANDS, WIDTH, HEADS, LAYERS, FEED, FRAMES, HARMONICS = 6, 256, 257, 128, 4, 3, 512, 173, 4
torch.set_num_threads(THREADS)
torch.manual_seed(1)


class Network(nn.Module):
    def __init__(self):
        super().__init__()
        mlp = lambda inputs: nn.Sequential(nn.Linear(inputs, WIDTH), nn.PReLU(), nn.Linear(WIDTH, WIDTH))
        self.seen, self.relative, self.query = mlp(150), mlp(63), nn.Linear(21, WIDTH)
        self.own = nn.ModuleList(nn.MultiheadAttention(WIDTH, HEADS, batch_first=True) for _ in range(LAYERS))
        self.cross = nn.ModuleList(nn.MultiheadAttention(WIDTH, HEADS, batch_first=True) for _ in range(LAYERS))
        self.feed = nn.ModuleList(nn.Sequential(nn.Linear(WIDTH, FEED), nn.ReLU(), nn.Linear(FEED, WIDTH)) for _ in range(LAYERS))
        self.norms = nn.ModuleList(nn.LayerNorm(WIDTH) for _ in range(3 * LAYERS + 1))
        self.audio = nn.Parameter(torch.randn(ANCHORS, WIDTH))
        self.mix, self.difference, self.taps = nn.Linear(WIDTH, 1), nn.Linear(WIDTH, 1), nn.Linear(WIDTH, 4)

    def forward(self, features, relative, queries):
        value = self.relative(relative)
        key = value + self.seen(features)
        t = self.query(queries).relu()[None]
        for i in range(LAYERS):
            # The first layer's own attention is the same for all listeners.
            t = self.norms[3 * i](t + self.own[i](t, t, t, need_weights=False)[0]).expand(BATCH, -1, -1)
            crossed, attention = self.cross[i](t, key, value, need_weights=i == LAYERS - 1)
            t = self.norms[3 * i + 1](t + crossed)
            t = self.norms[3 * i + 2](t + self.feed[i](t))
        t = self.norms[-1](t)
        return self.mix(attention @ self.audio), 2 * self.difference(t).sigmoid() - 1, self.taps(t)


class Head(nn.Module):
    def __init__(self):
        super().__init__()
        self.by_band = nn.Parameter(torch.randn(ANCHORS, BANDS, HARMONICS))
        self.by_frame = nn.Parameter(torch.randn(BANDS, FRAMES))
        self.features = nn.Parameter(0.02 * torch.randn(ANCHORS, 2 * FRAMES))
        layers = nn.Conv2d(4, 16, 7, padding=3), nn.ReLU(), nn.Conv2d(16, 16, 3, padding=1), nn.ReLU(), nn.Conv2d(16, 1, 3, padding=1)
        self.conv = nn.Sequential(*layers)

    def forward(self, mixture, difference, harmonics, magnitudes):
        masked = magnitudes * mixture
        anchors = torch.einsum("bnh,nfh->bnf", harmonics, self.by_band)
        inputs, biases = (self.features / ANCHORS ** 0.5).split(FRAMES, 1)
        kernel = (anchors @ self.by_frame / BANDS ** 0.5).transpose(1, 2) @ inputs
        mix = masked @ kernel.transpose(1, 2) + anchors.transpose(1, 2) @ biases
        ears = []
        for sign in (-1, 1):
            base = (1 + sign * difference) * masked
            planes = torch.stack([mix, base, mixture.expand_as(base), sign * difference.expand_as(base)], 1)
            ears.append((self.conv(planes)[:, 0] + base).relu())
        return ears


def median(parameters, loss):
    optimiser = torch.optim.AdamW(parameters, lr=1e-4)
    times = []
    for _ in range(8):
        began = time.perf_counter()
        value = loss()
        optimiser.zero_grad()
        value.backward()
        optimiser.step()
        times.append(time.perf_counter() - began)
    return statistics.median(times[1:])


network, head = Network(), Head()
inputs = torch.randn(ANCHORS, 150), torch.randn(BATCH, ANCHORS, 63), torch.randn(BANDS, 21)
clips = torch.randn(BATCH, ANCHORS, HARMONICS), torch.rand(BATCH, BANDS, FRAMES)
alone = median(network.parameters(), lambda: sum(part.square().mean() for part in network(*inputs)))
whole = median(
    [*network.parameters(), *head.parameters()], lambda: sum(ear.square().mean() for ear in head(*network(*inputs)[:2], *clips))
)
print(f"PyTorch {torch.__version__}, {THREADS} threads: {alone:.3f} s a step, network alone; {whole:.3f} s with time filters and convolutions")
