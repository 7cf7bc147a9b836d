#!/usr/bin/env python3
"""Makes the small checkpoints that crates/baker/tests/checkpoint.rs reads.

    python make_fixtures.py [--exported]

N = 4 anchors, C = 8 wide, F = 5 frequencies, T = 3 frames, 1 octave, 6 features. Value j of an array is ((7 j + length of its name)
mod 61 - 30) / 64, which every floating-point format holds exactly. With --exported also what export_avcloud.py makes of a checkpoint
of PyTorch, which needs torch, numpy and safetensors.
"""
import json
import math
import pickle
import struct
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).parent
EXPORTER = HERE.parents[3] / "presets/recipes/export_avcloud.py"
N, C, F, T, K, HIDDEN = 4, 8, 5, 3, 6, 2


def linear(stem, outputs, *inputs):
    return {f"{stem}.weight": (outputs, *inputs), f"{stem}.bias": (outputs,)}


def shapes(kind):
    """The arrays' shapes by their names."""
    found = {"_audio_features_f": (N, C, 1), "vec_embedder.freqs": (1,)}
    for stem, inputs in (("pcd_av_proj", K), ("vec_proj", 9)):
        found |= linear(f"{stem}.0.proj", C, inputs) | {f"{stem}.1.weight": (1,)} | linear(f"{stem}.2.proj", C, C)
    found |= linear("diff_prj", 1, C) | linear("mix_prj", 1, C)
    if kind == "simple_sh":
        found["freq_weights"] = (F, C)
    else:
        layer = "decoder.layers.0"
        for attention in ("self_attn", "multihead_attn"):
            found |= {f"{layer}.{attention}.in_proj_weight": (3 * C, C), f"{layer}.{attention}.in_proj_bias": (3 * C,)}
            found |= linear(f"{layer}.{attention}.out_proj", C, C)
        found |= linear(f"{layer}.linear1", C, C) | linear(f"{layer}.linear2", C, C)
        for norm in (f"{layer}.norm1", f"{layer}.norm2", f"{layer}.norm3", "decoder.norm"):
            found |= linear(norm, C)
        found |= {"freq_embedder.freqs": (1,)} | linear("query_prj.0", C, 3)
    if kind == "full":
        for model, outputs in (("weight_model", 3 * T * T), ("bias_model", T)):
            found |= linear(f"post_process.{model}.0", HIDDEN, C, 1) | linear(f"post_process.{model}.2", outputs, HIDDEN, 1)
    else:
        found |= {"time_freq_weights": (N, F, 4), "_acoustic_features_t": (N, 2 * T), "time_weights": (F, T)}
    return found


def values(name, shape):
    return [((7 * j + len(name)) % 61 - 30) / 64 for j in range(math.prod(shape))]


def packed(dtype, numbers):
    if dtype == "BF16":
        return b"".join(struct.pack("<f", v)[2:] for v in numbers)
    return struct.pack(f"<{len(numbers)}{ {'F64': 'd', 'F32': 'f', 'F16': 'e'}[dtype]}", *numbers)


def save(name, arrays, metadata, dtypes=("F32",)):
    header, data = {"__metadata__": metadata} if metadata else {}, b""
    for i, (array, shape) in enumerate(arrays.items()):
        dtype = dtypes[i % len(dtypes)]
        one = packed(dtype, values(array, shape))
        header[array] = {"dtype": dtype, "shape": list(shape), "data_offsets": [len(data), len(data) + len(one)]}
        data += one
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    (HERE / name).write_bytes(struct.pack("<Q", len(text)) + text + data)


def exported():
    import numpy as np
    import torch

    def array(name, shape):
        return torch.tensor(values(name, shape), dtype=torch.float32).reshape(shape)

    full = {name: array(name, shape) for name, shape in shapes("full").items()}
    # As published training leaves the network that makes kernels.
    dead = {name: torch.zeros_like(v) if "weight_model.0" in name else v for name, v in full.items()}
    planes = np.zeros((N, 16, K), np.float32)
    planes[:, 0, :] = array("rgb_features", (N, K)).numpy()
    with TemporaryDirectory() as folder:
        checkpoint, anchors = Path(folder) / "dead.pth", Path(folder) / "anchors.pkl"
        anchors.write_bytes(pickle.dumps({"xyz": array("anchor_xyz", (N, 3)).numpy(), "features": planes}))
        torch.save({"epoch": 100, "model": "avcloud", "state_dict": dead}, checkpoint)
        export = [sys.executable, EXPORTER, checkpoint, anchors, "--max-norm", "25", "--sample-rate", "8000"]
        export += ["--n-fft", "8", "--hop", "2", "--heads", "1", "-o", HERE / "exported.safetensors"]
        subprocess.run(export, check=True)


def main():
    metadata = {"convention": "published", "max_norm": "25.0", "sample_rate": "8000.0", "n_fft": "8", "hop": "2", "heads": "1"}
    simple = metadata | {"kind": "simple-sh"}
    save("simple_sh.safetensors", shapes("simple_sh"), simple)
    # Its clips are long enough to be reflected at their ends.
    save("sh.safetensors", shapes("sh"), metadata | {"kind": "sh", "hop": "4"})
    save("full.safetensors", shapes("full"), metadata | {"kind": "full"})
    # The second array is of frequencies, which 16 bits do not hold.
    save("formats.safetensors", shapes("simple_sh"), simple, ("F64", "F32", "BF16", "F16"))
    save("anchors.safetensors", {"anchor_xyz": (N, 3), "rgb_features": (N, K)}, None)
    if sys.argv[1:] == ["--exported"]:
        exported()


if __name__ == "__main__":
    main()
