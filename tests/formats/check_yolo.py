"""Opens DATASET/yolo with supervision and holds its masks and classes against the native maps; loss.json must say what is lost."""

import json
import sys
from pathlib import Path

import numpy as np
import supervision as sv
import yaml

import native

dataset = Path(sys.argv[1])
root = dataset / "yolo"
images = native.read(dataset)
loss = json.loads((root / "loss.json").read_text())
told = {(l["image"], l["plant"]): l["iou"] for l in loss["plants"]}
data = yaml.safe_load((root / "data.yaml").read_text())
found = []

for split in native.SPLITS:
    own_images = native.of_split(images, split)
    assert (split in data) == bool(own_images)
    if not own_images:
        continue
    assert (root / data[split]).is_dir()
    read = sv.DetectionDataset.from_yolo(
        images_directory_path=str(root / "images" / split),
        annotations_directory_path=str(root / "labels" / split),
        data_yaml_path=str(root / "data.yaml"),
        force_masks=True,
    )
    assert read.classes == ["crop", "weed"] and len(read) == len(own_images)
    for path, image, detections in read:
        own = images[Path(path).stem]
        assert np.array_equal(image[..., ::-1], own.rgb)
        assert len(detections) == len(own.seen())
        for i, plant in enumerate(own.seen()):
            mask, truth = detections.mask[i], own.plant_mask(plant)
            assert read.classes[detections.class_id[i]] == plant["class"]
            # Cuts are painted; nothing of the plant is lost.
            assert (mask | ~truth).all()
            iou = (mask & truth).sum() / (mask | truth).sum()
            assert abs(told.pop((own.name, plant["number"])) - iou) < 1e-12
            found.append(iou)
            x, y, w, h = plant["seen"]["box"]
            assert np.abs(detections.xyxy[i] - [x, y, x + w, y + h]).max() < 1

assert not told
summary = loss["summary"]
assert summary["plants"] == len(found) and summary["exact"] == sum(iou == 1 for iou in found)
if found:
    assert abs(summary["mean_iou"] - np.mean(found)) < 1e-12 and summary["worst"]["iou"] == min(found)
print(f"yolo: {summary}")
