"""A TorchScript file in Python's torch against what the program computes: check_torchscript.py NETWORK.pt IO.safetensors."""

import json
import sys

import numpy as np
import torch
from safetensors.numpy import load_file

module = torch.jit.load(sys.argv[1])
facts = json.load(open(sys.argv[1] + ".json"))
io = load_file(sys.argv[2])
for case in [k.removeprefix("images_") for k in io if k.startswith("images_")]:
    images, ours = io[f"images_{case}"], io[f"scores_{case}"]
    if images.shape[1:3] != (facts["height"], facts["width"]):
        continue
    with torch.no_grad():
        scores = module(torch.tensor(images.astype(np.uint8))).numpy()
    apart = np.abs(scores - ours).max() / max(1.0, np.abs(ours).max())
    print(f"{facts['network']} {images.shape}: apart by {apart:.1e}")
    assert apart < 1e-4, apart
    checked = True
assert checked
