"""Reads a packed dataset with `furrow.Dataset` and torch's loader: the images equal those in the archives."""

import io
import json
import sys
import tarfile
from pathlib import Path

root = Path(sys.argv[1])
sys.path.insert(0, sys.argv[2])
import furrow
import numpy as np
import torch
from PIL import Image

files = {}
for path in sorted(root.glob("packs/*.tar")):
    with tarfile.open(path) as archive:
        files.update({name: archive.extractfile(name).read() for name in archive.getnames()})
dataset = furrow.Dataset(root)
assert len(dataset) == 11
for k in (10, 0, 3, 7):
    sample = dataset[k]
    assert sample["record"] == json.loads(files[f"{k:06d}.record.json"])
    assert (sample["image"] == np.array(Image.open(io.BytesIO(files[f"{k:06d}.rgb.png"])))).all()
    assert (sample["plants"] == np.array(Image.open(io.BytesIO(files[f"{k:06d}.plants.png"])))).all()
validation = furrow.Dataset(root, split="val")
assert [sample["record"]["index"] for sample in validation] == [3, 7]
loader = torch.utils.data.DataLoader(dataset, batch_size=4, num_workers=2, collate_fn=list)
assert [sample["record"]["index"] for batch in loader for sample in batch] == list(range(11))
