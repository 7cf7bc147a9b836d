#!/usr/bin/env python3
"""Times a step of PyTorch on what step_cost.rs trains in its second row: the network, forward, backward, AdamW, batches of 6
listeners. Transforms, the render head and a loss over waveforms are left out, so PyTorch has less to do. Needs PyTorch.
Usage: step_cost.py [THREADS]
"""
import statistics
import sys
import time

import torch
from torch import nn

THREADS = int(sys.argv[1]) if len(sys.argv) > 1 else 1
BATCH, ANCHORS, BANDS, WIDTH, HEADS, LAYERS, FEED = 6, 256, 257, 128, 4, 3, 512
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


network = Network()
inputs = torch.randn(ANCHORS, 150), torch.randn(BATCH, ANCHORS, 63), torch.randn(BANDS, 21)
step = median(network.parameters(), lambda: sum(part.square().mean() for part in network(*inputs)))
print(f"PyTorch {torch.__version__}, {THREADS} threads: {step:.3f} s a step of the network")
