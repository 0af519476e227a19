"""Opens DATASET/yolo, yolo-detect, yolo-obb and yolo-pose with Ultralytics' own dataset class and compares the result with the native maps;
loss.json must state the loss of the masks that it rasterizes."""

import json
import os
import shutil
import sys
import tempfile
from pathlib import Path

scratch = tempfile.mkdtemp()
# Set before the import: the folder of its settings.
os.environ["YOLO_CONFIG_DIR"] = scratch

import numpy as np
from ultralytics.data import utils
from ultralytics.data.dataset import YOLODataset
from ultralytics.utils.ops import resample_segments

import native

# Prevents the download of a font for plots.
utils.check_font = lambda *_: None

dataset = Path(sys.argv[1])
images = native.read(dataset)
found = []
points = 0


def painted(truth, segment):
    """IoU of a mask and its rasterized polygon, which must contain the whole mask."""
    height, width = truth.shape
    mask = utils.polygon2mask((height, width), [(segment * [width, height]).reshape(-1)]).astype(bool)
    assert (mask | ~truth).all()
    return (mask & truth).sum() / (mask | truth).sum()


def ious(own, segments):
    # As before training: the same number of vertices for all polygons.
    most = max([1000, *(len(segment) + 1 for segment in segments)])
    for plant, segment in zip(own.seen(), segments, strict=True):
        truth = own.plant_mask(plant)
        iou = painted(truth, segment)
        more = painted(truth, resample_segments([segment.copy()], n=most)[0])
        # The rasterized polygon contains the whole mask, so its area is the mask's area divided by the IoU.
        beside = truth.sum() / more - truth.sum() / iou
        assert beside <= 2 + 0.01 * truth.sum(), (iou, more, truth.sum())
        yield plant, iou


def keypoint(point, size):
    """A label in the layout of a row."""
    if not point or point["state"] == "outside":
        return [0, 0, 0]
    return [point["x"] / size[0], point["y"] / size[1], 2 if point["state"] == "visible" else 1]


def check_oriented(own, segments):
    """Each rectangle contains all pixels of its plant, and is at most as large as the upright box."""
    height, width = own.plants.shape
    for plant, segment in zip(own.seen(), segments, strict=True):
        corners = segment * [width, height]
        assert corners.shape == (4, 2)
        sides = np.roll(corners, -1, 0) - corners
        lengths = np.hypot(*sides.T)
        assert abs(sides[0] @ sides[1]) < 1e-4 * lengths[0] * lengths[1]
        rows, columns = np.nonzero(own.plant_mask(plant))
        pixels = np.concatenate([np.stack([columns + dx, rows + dy], 1) for dx in (0, 1) for dy in (0, 1)])
        along = (pixels - corners[0]) @ (sides[:2] / lengths[:2, None]).T
        assert (along > -1e-3).all() and (along < lengths[:2] + 1e-3).all()
        box = plant["seen"]["box"]
        assert lengths[0] * lengths[1] < box[2] * box[3] + 1e-3


for name, task in [("yolo", "segment"), ("yolo-detect", "detect"), ("yolo-obb", "obb"), ("yolo-pose", "pose")]:
    # Ultralytics leaves a cache beside the labels.
    root = Path(scratch) / name
    shutil.copytree(dataset / name, root)
    data = utils.check_det_dataset(root / "data.yaml", autodownload=False)
    assert data["names"] == {0: "crop", 1: "weed"}
    told = json.loads((root / "loss.json").read_text()) if task == "segment" else None
    losses = {(l["image"], l["plant"]): l["iou"] for l in told["plants"]} if told else {}
    for split in native.SPLITS:
        own_images = native.of_split(images, split)
        if not own_images:
            continue
        read = YOLODataset(img_path=data[split], data=data, task=task, augment=False, imgsz=64)
        assert len(read.labels) == len(own_images)
        for label in read.labels:
            own = images[Path(label["im_file"]).stem]
            height, width = own.plants.shape
            assert label["shape"] == (height, width)
            seen = own.seen()
            assert [data["names"][int(c)] for c in label["cls"][:, 0]] == [p["class"] for p in seen]
            if task == "obb":
                check_oriented(own, label["segments"])
                continue
            boxes = np.array([p["seen"]["box"] for p in seen], float).reshape(-1, 4)
            boxes[:, :2] += boxes[:, 2:] / 2
            error = np.abs(label["bboxes"] * [width, height, width, height] - boxes)
            assert error.max(initial=0) < 0.03, error.max()
            if task == "segment":
                for plant, iou in ious(own, label["segments"]):
                    assert abs(losses.pop((own.name, plant["number"])) - iou) < 1e-12
                    found.append(iou)
            if task == "pose":
                for plant, read_points in zip(seen, label["keypoints"], strict=True):
                    tips = {leaf["number"]: leaf.get("tip") for leaf in plant["leaves"]}
                    expected = [plant.get("stem")] + [tips.get(k) for k in range(1, 17)]
                    expected = np.array([keypoint(p, (width, height)) for p in expected])
                    assert np.abs(read_points - expected).max() < 2e-6
                    points += int((expected[:, 2] > 0).sum())
    assert not losses
    if told:
        summary = told["summary"]
        assert summary["plants"] == len(found) and summary["exact"] == sum(iou == 1 for iou in found)
        if found:
            assert abs(summary["mean_iou"] - np.mean(found)) < 1e-12 and summary["worst"]["iou"] == min(found)

shutil.rmtree(scratch)
print(f"ultralytics: {len(found)} plants, mean IoU {np.mean(found or [1]):.4f}, {points} keypoints")
