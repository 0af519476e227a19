"""Reads DATASET/cropandweed like CropAndWeed's own scripts and compares boxes, labels and parameters with the native maps."""

import csv
import json
import sys
from pathlib import Path

import numpy as np

import native

dataset = Path(sys.argv[1])
root = dataset / "cropandweed"
images = native.read(dataset)
labels = {l["label"]: l for l in json.loads((root / "labels.json").read_text())["labels"]}
FIELDS = ["left", "top", "right", "bottom", "label_id", "stem_x", "stem_y"]
# Class numbers of CropAndWeed: sugar beet at its leaf count, and white goosefoot (fat hen).
BEET, GOOSEFOOT = 7, 33
plants = 0
used = set()

for split in native.SPLITS:
    listed = root / f"{split}.txt"
    own_images = native.of_split(images, split)
    assert listed.exists() == bool(own_images)
    names = listed.read_text().split() if listed.exists() else []
    assert len(names) == len(own_images)
    for name, own in zip(names, own_images):
        kind, session, image = name.split("-")
        assert kind == "ave" and int(session) * 10000 + int(image) == own.record["index"]
        # JPEG: similar, not equal.
        photograph = native.picture(root / f"images/{name}.jpg")
        assert photograph.shape == own.rgb.shape
        assert np.abs(photograph.astype(float) - own.rgb).mean() < 6
        label_map = native.picture(root / f"labelIds/CropAndWeed/{name}.png")
        assert label_map.dtype == np.uint8
        with open(root / f"bboxes/CropAndWeed/{name}.csv", newline="", encoding="utf-8") as file:
            rows = [{k: int(v) for k, v in row.items()} for row in csv.DictReader(file, fieldnames=FIELDS)]
        assert len(rows) == len(own.seen())
        for row, plant in zip(rows, own.seen()):
            x, y, w, h = plant["seen"]["box"]
            assert (row["left"], row["top"], row["right"], row["bottom"]) == (x, y, x + w, y + h)
            label = row["label_id"]
            assert set(label_map[own.plant_mask(plant)]) == {label}
            used.add(label)
            assert labels[label]["class"] == plant["class"]
            grown = plant["grown"]
            if grown["eppo"] == "BEAVX":
                leaves = grown["bbch"] - 10
                assert label == BEET + (5 if leaves >= 9 else leaves // 2)
            else:
                assert grown["eppo"] == "CHEAL" and label == GOOSEFOOT
            stem = plant["stem"]
            assert (row["stem_x"], row["stem_y"]) == (int(np.floor(stem["x"])), int(np.floor(stem["y"])))
            plants += 1
        assert (label_map[own.plants == 0] == 0).all()
        with open(root / f"params/{name}.csv", newline="") as file:
            (params,) = csv.DictReader(file)
        moisture = own.record["conditions"]["soil"]["moisture"]["mean"]
        assert int(params["moisture"]) == (moisture >= 1 / 3) + (moisture >= 2 / 3)
        assert int(params["lighting"]) == 0, "the lighting parameter must be 0"
        assert int(params["soil"]) in (0, 1, 2) and int(params["separability"]) in (0, 1, 2)

print(f"cropandweed: {plants} plants, labels {sorted(used)}")
