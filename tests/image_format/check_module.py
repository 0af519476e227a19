"""Reads JPEG images with `furrow`. Arguments: a dataset in folders, the same in packs, its scene file, the module's folder."""

import sys
from pathlib import Path

root, packed, scene, module = map(Path, sys.argv[1:])
sys.path.insert(0, str(module))

import furrow
import numpy as np
from PIL import Image

folders, packs = furrow.Dataset(root), furrow.Dataset(packed)
assert len(folders) == len(packs) == 3
for k in range(3):
    for name, file in (("image", "rgb.jpg"), ("nir", "nir.jpg")):
        with Image.open(root / f"images/{k:06d}" / file) as picture:
            expected = np.array(picture)
        assert np.array_equal(folders[k][name], expected) and np.array_equal(packs[k][name], expected), (k, name)
streamed = next(furrow.stream(scene, spp=2, width=96, image_format="jpeg95"))
assert np.array_equal(streamed["image"], folders[0]["image"]) and np.array_equal(streamed["nir"], folders[0]["nir"])
