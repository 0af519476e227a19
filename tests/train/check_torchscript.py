"""Compares exported TorchScript files, run in Python's torch, with the program's output.

    check_torchscript.py FOLDER...

Each folder holds `network.pt`, `network.pt.json` and `io.safetensors`, as in `check_onnx.py`.
"""

import json
import sys

import numpy as np
import torch
from safetensors.numpy import load_file


def check(folder):
    module = torch.jit.load(f"{folder}/network.pt")
    # The code names no device, so it runs on the device to which its weights are loaded.
    assert "device" not in module.code, module.code
    facts = json.load(open(f"{folder}/network.pt.json"))
    io = load_file(f"{folder}/io.safetensors")
    checked = 0
    for case in [k.removeprefix("images_") for k in io if k.startswith("images_")]:
        images, ours = io[f"images_{case}"], io[f"scores_{case}"]
        if images.shape[1:3] != (facts["height"], facts["width"]):
            continue
        with torch.no_grad():
            scores = module(torch.tensor(images.astype(np.uint8))).numpy()
        apart = np.abs(scores - ours).max() / max(1.0, np.abs(ours).max())
        print(f"{facts['network']} {images.shape}: apart by {apart:.1e}")
        assert apart < 1e-4, apart
        checked += 1
    assert checked > 0, folder


if __name__ == "__main__":
    for folder in sys.argv[1:]:
        check(folder)
