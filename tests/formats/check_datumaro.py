"""Opens DATASET/{coco,panoptic,cityscapes} with datumaro and compares its masks with the native maps."""

import shutil
import sys
import tempfile
from pathlib import Path

import datumaro as dm
import numpy as np
from datumaro.components.annotation import AnnotationType

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
CLASSES = {"soil": 0, "crop": 1, "weed": 2}


def opened(folder, kind):
    """Pairs of an item and the native image that it must equal."""
    read = dm.Dataset.import_from(str(dataset / folder), kind)
    labels = [label.name for label in read.categories()[AnnotationType.label]]
    items = list(read)
    assert len(items) == len(images)
    for item in items:
        own = images[item.id.split("/")[-1].split("_")[-1]]
        assert item.subset == own.split
        assert np.array_equal(item.media.data[..., ::-1].astype(np.uint8), own.rgb)
        yield item, own, labels


def masks(item, labels):
    """Class and pixels of each mask of an item."""
    return [(labels[a.label], a.image.astype(bool), a) for a in item.annotations if a.type == AnnotationType.mask]


# Importers sort the annotations by id, ascending or descending.
count = 0
for item, own, labels in opened("coco", "coco_instances"):
    found = {a.attributes["plant"]: (label, mask) for label, mask, a in masks(item, labels)}
    assert len(found) == len(own.seen())
    for plant in own.seen():
        label, mask = found[plant["number"]]
        assert label == plant["class"] and np.array_equal(mask, own.plant_mask(plant))
    count += len(found)
# datumaro reads only files of this name.
leaves = Path(tempfile.mkdtemp())
shutil.copytree(dataset / "coco/images", leaves / "images")
(leaves / "annotations").mkdir()
for file in (dataset / "coco/annotations").glob("leaves_*.json"):
    shutil.copy(file, leaves / "annotations" / file.name.replace("leaves", "instances"))
for item, own, labels in opened(leaves, "coco_instances"):
    found = {(a.attributes["plant"], a.attributes["leaf"]): (label, mask) for label, mask, a in masks(item, labels)}
    assert len(found) == len(own.seen_leaves())
    for plant, leaf in own.seen_leaves():
        label, mask = found[plant["number"], leaf["number"]]
        assert label == "leaf" and np.array_equal(mask, own.leaf_mask(plant, leaf))
    count += len(found)
shutil.rmtree(leaves)
print(f"coco in datumaro: {count} masks")

count = 0
for item, own, labels in opened("panoptic", "coco_panoptic"):
    found = {a.id: (label, mask, a) for label, mask, a in masks(item, labels)}
    sizes = sum(mask.sum() for _, mask, _ in found.values())
    assert sizes == own.semantics.size, "every pixel must have one segment"
    for plant in own.seen():
        label, mask, a = found.pop(plant["number"])
        assert label == plant["class"] and np.array_equal(mask, own.plant_mask(plant))
        assert not a.attributes["is_crowd"]
        count += 1
    ((number, (label, mask, _)),) = found.items()
    assert (number, label) == (65536 + 4, "soil") and np.array_equal(mask, own.semantics == 0)
print(f"panoptic in datumaro: {count} plants")

count = 0
for item, own, labels in opened("cityscapes", "cityscapes"):
    assert labels == list(CLASSES)
    found = {label: mask for label, mask, _ in masks(item, labels)}
    # Black is background in datumaro, so soil has no mask.
    assert set(found) == {name for name, n in CLASSES.items() if n and (own.semantics == n).any()}
    for label, mask in found.items():
        assert np.array_equal(mask, own.semantics == CLASSES[label])
        count += 1
print(f"cityscapes in datumaro: {count} class masks")
