"""Compares the segments of DATASET/panoptic with its images, decoded like panopticapi, and with the native maps."""

import json
import sys
from pathlib import Path

import numpy as np

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
segments = 0

for split in native.SPLITS:
    own_images = native.of_split(images, split)
    path = dataset / f"panoptic/annotations/panoptic_{split}.json"
    assert path.exists() == bool(own_images)
    if not own_images:
        continue
    whole = json.loads(path.read_text())
    categories = {c["id"]: c for c in whole["categories"]}
    assert {c["name"]: c["isthing"] for c in categories.values()} == {"crop": 1, "weed": 1, "soil": 0}
    assert all(len(c["color"]) == 3 for c in categories.values())
    files = {i["id"]: i["file_name"] for i in whole["images"]}
    assert len(files) == len(own_images) == len(whole["annotations"])
    for annotation in whole["annotations"]:
        own = images[annotation["file_name"].removesuffix(".png")]
        assert files[annotation["image_id"]] == annotation["file_name"]
        picture = native.picture(path.with_suffix("") / annotation["file_name"]).astype(int)
        ids = picture[..., 0] + 256 * picture[..., 1] + 65536 * picture[..., 2]
        assert set(np.unique(ids)) == {s["id"] for s in annotation["segments_info"]}
        for segment in annotation["segments_info"]:
            mask = ids == segment["id"]
            ys, xs = np.where(mask)
            assert segment["area"] == mask.sum() and segment["iscrowd"] == 0
            assert segment["bbox"] == [xs.min(), ys.min(), xs.max() + 1 - xs.min(), ys.max() + 1 - ys.min()]
            (number,) = set(own.semantics[mask])
            assert categories[segment["category_id"]]["name"] == ["soil", "crop", "weed"][number]
            assert set(own.plants[mask]) == {segment["id"] if number else 0}
            segments += 1

print(f"panoptic: {segments} segments")
