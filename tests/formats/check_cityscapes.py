"""Compares DATASET/cityscapes with the native maps: names, classes, and instances as cityscapesScripts counts them."""

import json
import re
import sys
from pathlib import Path

import numpy as np

import native

dataset = Path(sys.argv[1])
root = dataset / "cityscapes"
images = native.read(dataset)
NAME = re.compile(r"([a-z0-9]+)_(\d{6})_(\d{6})_leftImg8bit\.png")
plants = 0

photographs = sorted((root / "leftImg8bit").glob("*/*/*.png"))
assert len(photographs) == len(images)
for path in photographs:
    city, sequence, frame = NAME.fullmatch(path.name).groups()
    own = images[f"{int(sequence) * 1000000 + int(frame):06}"]
    assert path.parent.name == city and path.parent.parent.name == own.split
    assert np.array_equal(native.picture(path), own.rgb)
    truth = root / "gtFine" / own.split / city

    def labels(kind):
        return native.picture(truth / path.name.replace("leftImg8bit", f"gtFine_{kind}"))

    assert np.array_equal(labels("labelIds"), own.semantics)
    assert np.array_equal(labels("labelTrainIds"), own.semantics)
    instances = labels("instanceIds").astype(int)
    # An id below 1000 is a class without instances; otherwise the class is in the digits before the last three.
    classes = np.where(instances < 1000, instances, instances // 1000)
    assert np.array_equal(classes, own.semantics)
    for plant in own.seen():
        (number,) = set(instances[own.plant_mask(plant)])
        assert number >= 1000 and np.array_equal(instances == number, own.plant_mask(plant))
        plants += 1
    assert len(np.unique(instances[instances >= 1000])) == len(own.seen())
    colors = np.array([[0, 0, 0], [0, 255, 0], [255, 0, 0]])
    assert np.array_equal(labels("color"), colors[own.semantics])

assert json.loads((root / "groups.json").read_text())["groups"] == []
print(f"cityscapes: {len(photographs)} images, {plants} plants")
