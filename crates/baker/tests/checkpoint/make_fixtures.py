#!/usr/bin/env python3
"""Makes the small checkpoints that crates/baker/tests/checkpoint.rs reads. Needs torch, numpy and safetensors.

    python make_fixtures.py

N = 4 anchors, C = 8 wide, F = 5 frequencies, T = 3 frames, 1 octave, 6 features. Value j of an array is ((7 j + length of its name)
mod 61 - 30) / 64, which every floating-point format holds exactly.
"""
import pickle
import subprocess
import sys
from collections import OrderedDict
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import torch

HERE = Path(__file__).parent
EXPORTER = HERE.parents[2] / "presets/recipes/export_avcloud.py"
N, C, F, T, K, HIDDEN = 4, 8, 5, 3, 6, 2


def tensor(name, *shape):
    j = torch.arange(int(np.prod(shape)), dtype=torch.float32)
    return (((7 * j + len(name)) % 61 - 30) / 64).reshape(shape)


def linear(stem, outputs, *inputs):
    return {f"{stem}.weight": (outputs, *inputs), f"{stem}.bias": (outputs,)}


def state(kind):
    shapes = {"_audio_features_f": (N, C, 1), "vec_embedder.freqs": (1,)}
    for stem, inputs in (("pcd_av_proj", K), ("vec_proj", 9)):
        shapes |= linear(f"{stem}.0.proj", C, inputs) | {f"{stem}.1.weight": (1,)} | linear(f"{stem}.2.proj", C, C)
    shapes |= linear("diff_prj", 1, C) | linear("mix_prj", 1, C)
    if kind == "simple-sh":
        shapes["freq_weights"] = (F, C)
    else:
        layer = "decoder.layers.0"
        for attention in ("self_attn", "multihead_attn"):
            shapes |= {f"{layer}.{attention}.in_proj_weight": (3 * C, C), f"{layer}.{attention}.in_proj_bias": (3 * C,)}
            shapes |= linear(f"{layer}.{attention}.out_proj", C, C)
        shapes |= linear(f"{layer}.linear1", C, C) | linear(f"{layer}.linear2", C, C)
        for norm in (f"{layer}.norm1", f"{layer}.norm2", f"{layer}.norm3", "decoder.norm"):
            shapes |= linear(norm, C)
        shapes |= {"freq_embedder.freqs": (1,)} | linear("query_prj.0", C, 3)
    if kind == "full":
        for model, outputs in (("weight_model", 3 * T * T), ("bias_model", T)):
            shapes |= linear(f"post_process.{model}.0", HIDDEN, C, 1) | linear(f"post_process.{model}.2", outputs, HIDDEN, 1)
    else:
        shapes |= {"time_freq_weights": (N, F, 4), "_acoustic_features_t": (N, 2 * T), "time_weights": (F, T)}
    return OrderedDict((name, tensor(name, *shape)) for name, shape in shapes.items())


def trainer(weights):
    """A file as the published trainer lays it out, with a touch of optimiser."""
    moments = {"step": torch.tensor(7.0), "exp_avg": torch.ones(2), "exp_avg_sq": torch.ones(2)}
    optimizer = {"state": {0: moments}, "param_groups": [{"lr": 5e-4, "betas": (0.9, 0.999), "params": [0]}]}
    schedule = {"decay_epochs": 100, "gamma": 0.1, "base_lrs": [5e-4], "last_epoch": 100}
    return {"epoch": 100, "model": "avcloud", "state_dict": weights, "optimizer": optimizer, "lr_scheduler": schedule}


def main():
    simple, full = state("simple-sh"), state("full")
    torch.save(trainer(simple), HERE / "nested.pth")
    # One array is a transposed view of its storage.
    flat = simple | {"freq_weights": simple["freq_weights"].t().contiguous().t()}
    torch.save(flat, HERE / "flat.pth")
    torch.save(trainer(simple), HERE / "legacy.pth", _use_new_zipfile_serialization=False)
    torch.save({f"module.{k}": v for k, v in simple.items()}, HERE / "module.pth")
    # The second array is of frequencies, which 16 bits do not hold.
    formats = (torch.float64, torch.float32, torch.bfloat16, torch.float16)
    torch.save({k: v.to(formats[i % 4]) for i, (k, v) in enumerate(simple.items())}, HERE / "formats.pth")
    torch.save({"freq_weights": torch.ones(F, C, dtype=torch.int32)}, HERE / "integer.pth")
    torch.save(state("sh"), HERE / "sh.pth", _use_new_zipfile_serialization=False)
    torch.save(trainer(full), HERE / "full.pth")
    torch.save(torch.ones(3), HERE / "tensor.pth")
    torch.save({"conv.weight": torch.ones(3), "conv.bias": torch.ones(1)}, HERE / "other.pth")
    torch.save({"epoch": 3, "model": "avcloud"}, HERE / "empty.pth")

    positions, features = tensor("anchor_xyz", N, 3).numpy(), tensor("rgb_features", N, K).numpy()
    np.savez(HERE / "anchors.npz", anchor_xyz=positions, rgb_features=features)
    # Columns first, doubles, compressed.
    np.savez_compressed(HERE / "anchors_f8.npz", xyz=np.asfortranarray(positions, np.float64), features=features.astype(np.float64))
    planes = np.zeros((N, 16, K), np.float32)
    planes[:, 0, :] = features
    (HERE / "anchors.pkl").write_bytes(pickle.dumps({"xyz": positions, "features": planes}))
    # As published training leaves the network that makes kernels.
    dead = OrderedDict((k, torch.zeros_like(v) if "weight_model.0" in k else v) for k, v in full.items())
    with TemporaryDirectory() as folder:
        checkpoint = Path(folder) / "dead.pth"
        torch.save(trainer(dead), checkpoint)
        export = [sys.executable, EXPORTER, checkpoint, HERE / "anchors.pkl", "--max-norm", "25", "--sample-rate", "8000"]
        export += ["--n-fft", "8", "--hop", "2", "--heads", "1", "-o", HERE / "exported.safetensors"]
        subprocess.run(export, check=True)


if __name__ == "__main__":
    main()
