"""Compares DATASET/parts with the native maps: organs are only on plants."""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image

import native

dataset = Path(sys.argv[1])
root = dataset / "parts"
names = {int(number): name for number, name in json.loads((root / "names.json").read_text()).items()}
LEAVES = {"blade", "petiole", "cotyledon", "sheath"}
ORGANS = LEAVES | {"hypocotyl", "stem", "flower", "bud", "head", "ear", "tassel", "pod", "berry"}
organs = [number for number, name in names.items() if name in ORGANS]
seen = set()
for name, image in native.read(dataset).items():
    picture = Image.open(root / image.split / f"{name}.png")
    assert picture.mode == "P"
    parts = np.array(picture)
    assert parts.shape == image.semantics.shape
    assert set(np.unique(parts)) - {0} <= set(names)
    assert (np.isin(parts, organs) == (image.plants > 0)).all()
    # Plant pixels without a leaf are stem, hypocotyl, flower or fruit; leaf pixels are none of these.
    of = lambda *kinds: np.isin(parts, [number for number, name in names.items() if name in kinds])
    plants, leaves = image.plants > 0, image.leaves > 0
    assert (of(*(ORGANS - LEAVES))[plants] == ~leaves[plants]).all()
    assert of(*LEAVES)[leaves].all()
    assert ((image.semantics == 0) == ~plants).all()
    seen |= {names[number] for number in np.unique(parts) if number}
assert "soil" in seen
print("parts:", sorted(seen))
