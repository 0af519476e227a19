"""Compares DATASET/damage with the label maps: damage is only on blades and cotyledons."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image

import native

dataset = Path(sys.argv[1])
BLADE, COTYLEDON = 11, 13
MAPS = ("chlorosis", "necrosis", "dust", "edges")
most = dict.fromkeys(MAPS, 0)
for name, image in native.read(dataset).items():
    parts = np.array(Image.open(dataset / "parts" / image.split / f"{name}.png"))
    blades = np.isin(parts, (BLADE, COTYLEDON))
    maps = {}
    for kind in MAPS:
        picture = Image.open(dataset / "damage" / image.split / kind / f"{name}.png")
        assert picture.mode == "L"
        maps[kind] = np.array(picture).astype(int)
        assert maps[kind].shape == image.semantics.shape
        assert (maps[kind][~blades] == 0).all()
        most[kind] = max(most[kind], maps[kind].max())
    # Two fractions of the same point, each rounded.
    assert (maps["chlorosis"] + maps["necrosis"]).max() <= 256
    assert set(np.unique(maps["edges"])) <= {0, 255}
print("damage: most of", most)
