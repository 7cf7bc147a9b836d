"""Cost of the anchor-cloud decoders beside eager PyTorch and ONNX Runtime on one thread, same shapes, taking turns in one run.

usage: decode_ratio.py BENCH [ROUNDS]

BENCH is the program that `cargo bench --bench decode_cost -p promenade-core --no-run` builds and names. Unit: processor milliseconds
per decode, median over rounds; ratios are of medians. Random weights: neither side's time depends on them. ONNX Runtime plays what
`torch.onnx.export` makes of the same model, visual features cached; without the packages onnx, onnxscript and onnxruntime it is skipped.
"""

import os

# Before the first import of anything that starts threads.
os.environ.update(OMP_NUM_THREADS="1", MKL_NUM_THREADS="1")

import statistics
import subprocess
import sys
import tempfile
import time

import torch
from torch import nn
from torch.nn import functional

WIDTH, HEADS, LAYERS, FEED_FORWARD, OCTAVES, FEATURES = 128, 4, 3, 512, 10, 150
MAX_NORM = 25.0
# Decodes of one side in a row, and how many of them are not counted.
TURN, WARM = 8, 3


def encode(x, frequencies):
    """x, sines and cosines, each block as wide as x."""
    phases = [x * f for f in frequencies]
    return torch.cat([x, *map(torch.sin, phases), *map(torch.cos, phases)], dim=-1)


def mlp(inputs):
    return nn.Sequential(nn.Linear(inputs, WIDTH), nn.PReLU(), nn.Linear(WIDTH, WIDTH))


class Layer(nn.Module):
    def __init__(self):
        super().__init__()
        self.own = nn.MultiheadAttention(WIDTH, HEADS)
        self.cross = nn.MultiheadAttention(WIDTH, HEADS)
        self.wide, self.narrow = nn.Linear(WIDTH, FEED_FORWARD), nn.Linear(FEED_FORWARD, WIDTH)
        self.norms = nn.ModuleList(nn.LayerNorm(WIDTH) for _ in range(3))

    def forward(self, t, key, value, need_weights):
        t = self.norms[0](t + self.own(t, t, t, need_weights=False)[0])
        cross, weights = self.cross(t, key, value, need_weights=need_weights)
        t = self.norms[1](t + cross)
        return self.norms[2](t + self.narrow(functional.relu(self.wide(t)))), weights


class Anchors(nn.Module):
    """Keys and values of anchors: relative vectors, positional encoding, two small networks."""

    def __init__(self, anchors):
        super().__init__()
        self.xyz, self.rgb = torch.randn(anchors, 3) * 5, torch.randn(anchors, FEATURES)
        self.frequencies = 2.0 ** (10 * torch.arange(OCTAVES) / 9)
        self.relative, self.visual = mlp(3 * (1 + 2 * OCTAVES)), mlp(FEATURES)
        self.audio = torch.randn(anchors, WIDTH)
        self.mixture, self.difference = nn.Linear(WIDTH, 1), nn.Linear(WIDTH, 1)
        self.cache = None

    def keys_and_values(self, pose, cached):
        centre, rotation = pose[:3], pose[3:].view(3, 3)
        relative = (self.xyz - centre) @ rotation.T / MAX_NORM
        value = self.relative(encode(relative, self.frequencies))
        if self.cache is None or not cached:
            self.cache = self.visual(self.rgb)
        return value + self.cache, value

    def masks(self, mixed, embedding):
        return self.mixture(mixed)[..., 0], 2 * torch.sigmoid(self.difference(embedding)[..., 0]) - 1


class Transformer(Anchors):
    def __init__(self, anchors, bands):
        super().__init__(anchors)
        self.places = torch.linspace(-0.99, 0.99, bands)[:, None]
        self.query = nn.Linear(1 + 2 * OCTAVES, WIDTH)
        self.layers = nn.ModuleList(Layer() for _ in range(LAYERS))
        self.norm = nn.LayerNorm(WIDTH)

    def forward(self, pose, cached):
        key, value = (x[:, None] for x in self.keys_and_values(pose, cached))
        t = functional.relu(self.query(encode(self.places, self.frequencies)))[:, None]
        for i, layer in enumerate(self.layers):
            t, weights = layer(t, key, value, need_weights=i + 1 == LAYERS)
        return self.masks(weights[0] @ self.audio, self.norm(t)[:, 0])


class Linear(Anchors):
    def __init__(self, anchors, bands):
        super().__init__(anchors)
        self.query = torch.randn(bands, WIDTH)

    def forward(self, pose, cached):
        key, value = self.keys_and_values(pose, cached)
        weights = self.query @ key.T / WIDTH**0.5
        scale = len(key) ** -0.5
        return self.masks(weights @ self.audio * scale, weights @ value * scale)


START = torch.cat([torch.tensor([1.0, 0.0, 0.5]), torch.eye(3).flatten()])


class Bench:
    """One case of the Rust program, which decodes once per line and answers with seconds."""

    def __init__(self, program, case):
        self.process = subprocess.Popen([program, "--serve", case], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __call__(self):
        # All questions at once, so that it does not sleep in between.
        self.process.stdin.write("\n" * TURN)
        self.process.stdin.flush()
        return [float(self.process.stdout.readline()) for _ in range(TURN)]

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def eager(model, cached):
    steps = iter(range(1_000_000_000))

    def decode():
        pose = torch.cat([torch.tensor([1.0, 0.01 * next(steps), 0.5]), torch.eye(3).flatten()])
        start = time.thread_time()
        model(pose, cached)
        return time.thread_time() - start

    return lambda: [decode() for _ in range(TURN)]


def runtime(model, folder):
    """The same decoder in ONNX Runtime, or why not."""
    try:
        import onnxruntime
        import onnxscript  # noqa: F401, what the exporter needs.
    except ImportError as missing:
        return None, str(missing)

    class Cached(nn.Module):
        """The features are those of an earlier decode, as constants."""

        def __init__(self):
            super().__init__()
            self.model = model

        def forward(self, pose):
            return self.model(pose, True)

    path = os.path.join(folder, "decoder.onnx")
    model(START, True)
    torch.onnx.export(Cached().eval(), (START,), path, input_names=["pose"], dynamo=True, verbose=False)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    steps = iter(range(1_000_000_000))

    def decode():
        pose = START.numpy().copy()
        pose[1] = 0.01 * next(steps)
        start = time.thread_time()
        session.run(None, {"pose": pose})
        return time.thread_time() - start

    wanted = [part.numpy() for part in model(START, True)]
    found = session.run(None, {"pose": START.numpy()})
    apart = max(abs(a - b).max() for a, b in zip(wanted, found))
    assert apart < 1e-3, f"ONNX Runtime is {apart} off PyTorch"
    return lambda: [decode() for _ in range(TURN)], None


def main():
    program, rounds = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 41
    # Both sides on one core: another may be slower by what shares it.
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    torch.set_num_threads(1)
    torch.manual_seed(1)
    cases = {"full": (Transformer, 256, 257), "full, F 64": (Transformer, 256, 64), "linear": (Linear, 256, 257)}
    print(f"PyTorch {torch.__version__}, {rounds} rounds")
    columns = ["case", "ours ms", "PyTorch ms, visual features cached", "ratio", "PyTorch ms, uncached", "ratio", "ONNX Runtime ms", "ratio"]
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}")
    with torch.inference_mode(), tempfile.TemporaryDirectory() as folder:
        for name, (kind, anchors, bands) in cases.items():
            model = kind(anchors, bands).eval()
            onnx, why = runtime(model, folder)
            ours = Bench(program, name)
            runs = [ours, eager(model, True), eager(model, False), *([onnx] if onnx else [])]
            times = [[] for _ in runs]
            for _ in range(rounds):
                for run, taken in zip(runs, times):
                    # The first ones fill the caches that the other side has used.
                    taken.extend(1e3 * seconds for seconds in run()[WARM:])
            ours.close()
            own, *others = map(statistics.median, times)
            cells = [cell for other in others for cell in (f"{other:.3f}", f"{own / other:.3f}")]
            print(f"| {name} | {own:.3f} | {' | '.join(cells)} |" + (f" ONNX Runtime skipped: {why}" if why else ""))


if __name__ == "__main__":
    main()
