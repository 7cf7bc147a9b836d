#!/usr/bin/env python3
"""Puts a published AV-Cloud checkpoint and the anchors of its scene into one .safetensors file for `promenade`.

    export_avcloud.py CHECKPOINT.pth ANCHORS.(pkl|npz) --max-norm 25 --sample-rate 22050 -o scene.safetensors

The checkpoint holds neither the anchors nor max_norm (25 in published training, but 23.6032 for scene 6 and 183.2170 for scenes 12 and
13). The anchors are the trainer's `..._align_points_gs.pkl`: positions (N, 3), and features, the harmonics of the colours of each
anchor's 50 nearest points, as (N, 16, 150), of which the zeroth plane is kept, or (N, 150).

WARNING: a .pkl is a program, and opening it runs it. Give only pickles that you made or whose maker you trust, or an .npz.
Needs numpy, safetensors and PyTorch 1.13 or later.
"""
import argparse
import pickle
import sys
from pathlib import Path

import numpy as np
import torch
from safetensors.numpy import save_file

POSITIONS = ("anchors.position", "anchor_xyz", "xyz", "pcd", "points", "positions")
FEATURES = ("anchors.features", "rgb_features", "features", "feats", "shs")
DECODER = {"full": "post_process.", "simple-sh": "freq_weights", "sh": "time_weights"}


def fail(message):
    sys.exit(f"error: {message}")


def array(value):
    """An array of anything that has numbers in rows, else None."""
    if isinstance(value, torch.Tensor):
        value = value.detach().cpu().numpy()
    try:
        value = np.asarray(value)
    except ValueError:
        return None
    return value.astype(np.float32) if value.dtype.kind in "fiu" else None


def describe(value):
    """What a layout looks like, for messages."""
    if isinstance(value, dict):
        return "a dict with " + ", ".join(f"{k!r}: {describe(v)}" for k, v in value.items())
    if isinstance(value, (tuple, list)) and len(value) <= 8:
        return f"a {type(value).__name__} of ({', '.join(describe(v) for v in value)})"
    return f"{type(value).__name__} {tuple(getattr(value, 'shape', ()))}"


def load_anchors(path):
    """Positions (N, 3) and features (N, K) out of a pickle or .npz."""
    if path.suffix == ".npz":
        with np.load(path, allow_pickle=False) as file:
            content = {name: file[name] for name in file.files}
    else:
        print(f"warning: opening {path} runs what is in it", file=sys.stderr)
        with open(path, "rb") as file:
            content = pickle.load(file)
    if isinstance(content, dict):
        positions = next((content[k] for k in POSITIONS if k in content), None)
        features = next((content[k] for k in FEATURES if k in content), None)
    elif isinstance(content, (tuple, list)) and len(content) == 2:
        positions, features = content
    else:
        positions = features = None
    expected = f"a dict with one of {POSITIONS} and one of {FEATURES}, or a tuple (positions, features)"
    if positions is None or features is None:
        fail(f"{path}: expected {expected}; found {describe(content)}")
    positions, features = array(positions), array(features)
    if positions is None or features is None or positions.ndim != 2 or positions.shape[1] != 3:
        fail(f"{path}: expected positions of the shape (N, 3); found {describe(content)}")
    if features.ndim == 3:
        if features.shape[1] != 16:
            fail(f"{path}: expected features of the shape (N, 16, K), harmonics in the middle; found {features.shape}")
        features = features[:, 0, :]
    if features.ndim != 2 or len(features) != len(positions):
        fail(f"{path}: expected features of the shape ({len(positions)}, K); found {features.shape}")
    return positions, features


def load_weights(path):
    """The state dict of a checkpoint without the prefix of parallel training."""
    # Only tensors and plain values: other pickled objects are refused instead of run.
    content = torch.load(path, map_location="cpu", weights_only=True)
    state = content.get("state_dict", content) if isinstance(content, dict) else None
    if not isinstance(state, dict) or not state or not all(isinstance(v, torch.Tensor) for v in state.values()):
        fail(f"{path}: expected weights under 'state_dict' or by themselves; found {describe(content)[:400]}")
    return {key.removeprefix("module."): value.detach().float().numpy() for key, value in state.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("anchors", type=Path)
    parser.add_argument("--max-norm", type=float, required=True, help="distance that vectors were divided by in training")
    parser.add_argument("--sample-rate", type=float, required=True, help="of the training, Hz; published: 22050")
    parser.add_argument("--n-fft", type=int, default=512)
    parser.add_argument("--hop", type=int, default=127)
    parser.add_argument("--heads", type=int, default=4, help="attention heads")
    parser.add_argument("--kind", choices=DECODER, help="decoder; found from the weights unless given")
    parser.add_argument("--convention", choices=("published", "physical"), default="published", help="how the rotation is applied")
    parser.add_argument("-o", "--output", type=Path, required=True)
    args = parser.parse_args()

    weights = load_weights(args.checkpoint)
    positions, features = load_anchors(args.anchors)
    kind = args.kind or next((k for k, start in DECODER.items() if any(w.startswith(start) for w in weights)), None)
    if kind is None:
        fail(f"{args.checkpoint}: expected weights beginning with one of {tuple(DECODER.values())}; found {', '.join(list(weights)[:8])}")
    rows = weights["_audio_features_f"].shape[0] if "_audio_features_f" in weights else len(positions)
    if rows != len(positions):
        fail(f"the checkpoint has {rows} anchors, {args.anchors} has {len(positions)}: are they of the same scene?")
    arrays = {**weights, "anchors.position": positions, "anchors.features": features}
    metadata = {
        "kind": kind,
        "convention": args.convention,
        "max_norm": args.max_norm,
        "sample_rate": args.sample_rate,
        "n_fft": args.n_fft,
        "hop": args.hop,
        "heads": args.heads,
    }
    # Written by rows, which a transposed view is not.
    save_file({k: np.ascontiguousarray(v) for k, v in arrays.items()}, args.output, {k: str(v) for k, v in metadata.items()})
    print(f"{args.output}: {kind}, {len(positions)} anchors, {len(weights)} arrays of weights")


if __name__ == "__main__":
    main()
