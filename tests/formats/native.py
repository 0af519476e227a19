"""Reads a dataset's native files, with which every other format is compared."""

import json
from pathlib import Path

import numpy as np
from PIL import Image

SPLITS = ("train", "val", "test")


def picture(path):
    return np.array(Image.open(path))


def numbers(path):
    """Plant numbers: 16-bit grey, or R + 256 G + 65536 B."""
    found = picture(path).astype(int)
    return found @ [1, 1 << 8, 1 << 16] if found.ndim == 3 else found


class Native:
    """One image: its record and maps."""

    def __init__(self, folder):
        self.record = json.loads((folder / "record.json").read_text())
        self.name = self.record["name"]
        self.split = self.record["split"]
        self.rgb = picture(folder / "rgb.png")
        self.semantics = picture(folder / "semantics.png")
        self.plants = numbers(folder / "plants.png")
        self.leaves = picture(folder / "leaves.png").astype(int)

    def seen(self):
        return [p for p in self.record["plants"] if p["seen"]["pixels"] > 0]

    def seen_leaves(self):
        """Pairs of plant and leaf, without leaves that have no pixel."""
        return [(p, l) for p in self.seen() for l in p["leaves"] if l["seen"]["pixels"] > 0]

    def plant_mask(self, plant):
        return self.plants == plant["number"]

    def leaf_mask(self, plant, leaf):
        return self.plant_mask(plant) & (self.leaves == leaf["number"])


def inside(seen):
    """Fraction of a plant or leaf inside the frame."""
    whole, unoccluded = seen.get("whole"), seen.get("unoccluded")
    return unoccluded / whole if whole else 1.0


def read(dataset):
    """All images of a dataset by name."""
    images = [Native(folder) for folder in sorted((Path(dataset) / "images").iterdir())]
    return {image.name: image for image in images}


def of_split(images, split):
    return [image for image in images.values() if image.split == split]
