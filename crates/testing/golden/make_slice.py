"""Cuts the small slice of the golden vectors that every clone tests with.

    python make_slice.py FOLDER    # the folder with meta.json and *.golden.safetensors; needs numpy and safetensors

Outputs are thinned to every n-th value of the flattened array; `NAME.every` in `slice.json` says n.
"""

import json
import pathlib
import sys

import numpy as np
from safetensors.numpy import load_file, save_file

EVERY = {"mag_mask": 1, "diff": 1, "hs": 37, "attn_weights": 31, "mix_mag": 61, "left_mag": 61, "right_mag": 61, "out_wav": 29}
VARIANTS = {"full": "full", "sh": "sh", "simple-sh": "simple_sh"}


def main(folder: pathlib.Path) -> None:
    here = pathlib.Path(__file__).parent
    meta = json.loads((folder / "meta.json").read_text())
    weights = load_file(folder / "weights_union.safetensors")
    tensors, keys, kinds = {}, {}, {}
    for variant, file in VARIANTS.items():
        golden = load_file(folder / f"{file}.golden.safetensors")
        for name in ["anchor_xyz", "rgb_features", "poses", "input_wav"]:
            assert name not in tensors or np.array_equal(tensors[name], golden[name])
            tensors[name] = golden[name]
        for name, every in EVERY.items():
            tensors[f"{variant}/{name}"] = golden[name].reshape(-1)[::every].copy()
        entry = meta["variants"][variant]
        kinds[variant] = entry["keys"]
        for key in entry["keys"]:
            # Frequencies of the encodings are stored, everything else follows from its name.
            if key.endswith(".freqs"):
                tensors[key] = weights[key]
            else:
                keys[key] = {"shape": list(weights[key].shape), "scale": entry["scales"][key]}
    save_file(tensors, here / "slice.safetensors")
    (here / "slice.json").write_text(json.dumps({"every": EVERY, "kinds": kinds, "weights": keys}, indent=1) + "\n")


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
