"""Opens DATASET/phenobench with PhenoBench's own loader and compares it with the native maps."""

import os
import sys
from pathlib import Path

import numpy as np
from phenobench import PhenoBench

import native

dataset = Path(sys.argv[1])
root = dataset / "phenobench"
images = native.read(dataset)
TARGETS = ["semantics", "plant_instances", "leaf_instances", "plant_bboxes", "leaf_bboxes", "plant_visibility", "leaf_visibility"]


def of_255(share):
    """Rounds halves up; Python's own `round` rounds them to even."""
    return int(255 * share + 0.5)


partials = whole_plants = leaves = 0

for split in ("train", "val"):
    if not native.of_split(images, split):
        continue
    plain = PhenoBench(str(root), split, TARGETS)
    strict = PhenoBench(str(root), split, TARGETS, ignore_partial=True)
    assert len(plain) == len(native.of_split(images, split))
    for item, kept in zip(plain, strict):
        own = images[item["image_name"].removesuffix(".png")]
        assert own.split == split
        assert np.array_equal(np.array(item["image"]), own.rgb)
        # Maps partial plants back to their class.
        assert np.array_equal(item["semantics"], own.semantics)
        assert np.array_equal(item["plant_instances"], own.plants)
        written = native.picture(root / split / "semantics" / item["image_name"])
        assert written.dtype == np.uint16
        boxes = {}
        for box in item["plant_bboxes"]:
            boxes[tuple(int(n) for n in (*box["corner"], box["width"], box["height"]))] = box["label"]
        leaf_number = 0
        for plant in own.seen():
            mask, share = own.plant_mask(plant), native.inside(plant["seen"])
            partial = share < 0.5
            number = {"crop": 1, "weed": 2}[plant["class"]]
            assert set(written[mask]) == {number + 2 * partial}
            x, y, w, h = plant["seen"]["box"]
            # The loader subtracts 1 and omits partial plants.
            assert (boxes.pop((x, y, w - 1, h - 1), None) == number) or partial
            partials, whole_plants = partials + partial, whole_plants + (not partial)
            # ignore_partial
            assert set(kept["semantics"][mask]) == {255 if partial else number}
            assert set(kept["plant_instances"][mask]) == {0 if partial else plant["number"]}
            # Rule of the evaluation: one value per instance; the plant counts if it is above one half.
            (seen,) = set(item["plant_visibility"][mask])
            assert seen == of_255(share) and (seen / 255 > 0.5) == (not partial), (seen, share)
            for leaf in plant["leaves"]:
                leaf_mask = own.leaf_mask(plant, leaf)
                if leaf["seen"]["pixels"] == 0:
                    continue
                if plant["class"] == "weed":
                    assert set(item["leaf_instances"][leaf_mask]) == {0}
                    continue
                leaf_number += 1
                assert np.array_equal(item["leaf_instances"] == leaf_number, leaf_mask)
                assert set(item["leaf_visibility"][leaf_mask]) == {of_255(native.inside(leaf["seen"]))}
        assert not boxes
        leaves += leaf_number
        assert item["leaf_instances"].max() == leaf_number == len(item["leaf_bboxes"])
        assert (item["plant_visibility"][own.plants == 0] == 0).all()

if native.of_split(images, "test"):
    test = PhenoBench(str(root), "test")
    assert [item["image_name"] for item in test] == sorted(f"{image.name}.png" for image in native.of_split(images, "test"))
    assert os.listdir(root / "test") == ["images"]

print(f"phenobench: {len(images)} images, {whole_plants} whole and {partials} partial plants, {leaves} crop leaves")
