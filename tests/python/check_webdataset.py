"""Reads an archive of three images with the package webdataset. Argument: the archive."""

import io
import json
import sys

import numpy as np
import webdataset
from PIL import Image

data = webdataset.WebDataset(sys.argv[1], shardshuffle=False)
samples = list(data)
assert [s["__key__"].split("/")[-1] for s in samples] == ["000000", "000001", "000002"], [s["__key__"] for s in samples]
for index, sample in enumerate(samples):
    record = json.loads(sample["record.json"])
    assert record["index"] == index
    for name in ("rgb.png", "semantics.png", "plants.png", "leaves.png"):
        array = np.array(Image.open(io.BytesIO(sample[name])))
        assert array.shape[:2] == (record["height"], record["width"]), name
    classes = np.bincount(np.array(Image.open(io.BytesIO(sample["semantics.png"]))).ravel(), minlength=3)
    assert [c["pixels"] for c in record["classes"]] == classes[:3].tolist(), record["classes"]
