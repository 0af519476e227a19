"""Reads a dataset with furrow.torch: values, shapes and targets equal the files, and one of torchvision's detectors trains on a batch. Argument: a dataset of two images."""

import sys

import furrow
import numpy as np
import torch
from furrow.torch import Dataset, collate
from torch.utils.data import DataLoader
from torchvision.models.detection import fasterrcnn_mobilenet_v3_large_320_fpn as faster

folder = sys.argv[1]
files = furrow.Dataset(folder)

data = Dataset(folder, bands="rgbn")
assert len(data) == len(files) == 2
image, semantics = data[0]
assert image.shape == (4, *files[0]["semantics"].shape) and image.dtype == torch.float32
assert np.array_equal((image[:3] * 255).round().numpy().transpose(1, 2, 0), files[0]["image"])
assert np.array_equal((image[3] * 255).round().numpy(), files[0]["nir"])
assert np.array_equal(semantics.numpy(), files[0]["semantics"]) and semantics.dtype == torch.int64
((images, labels),) = DataLoader(data, batch_size=2, num_workers=2)
assert torch.equal(images[1], data[1][0]) and torch.equal(labels[1], data[1][1])
assert np.array_equal(Dataset(folder, target="plants")[1][1].numpy(), files[1]["plants"])
assert len(Dataset(folder, split="train")) == 1


def mirrored(image, target):
    return image.flip(-1), target.flip(-1)


flipped = Dataset(folder, bands="rgbn", transforms=mirrored)
assert torch.equal(flipped[0][0].flip(-1), image) and torch.equal(flipped[0][1].flip(-1), semantics)

found = Dataset(folder, target="detection")
for k in range(2):
    target, record = found[k][1], files[k]["record"]
    seen = [p for p in record["plants"] if p["seen"]["pixels"] > 0]
    assert seen and int(target["image_id"]) == record["index"]
    assert target["labels"].tolist() == [{"crop": 1, "weed": 2}[p["class"]] for p in seen]
    for plant, box, mask, area in zip(seen, target["boxes"], target["masks"], target["area"]):
        ys, xs = np.where(mask)
        assert box.tolist() == [xs.min(), ys.min(), xs.max() + 1, ys.max() + 1]
        assert mask.sum() == area == plant["seen"]["pixels"]

for wrong in ({"target": "boxes"}, {"bands": "rgbz"}, {"split": "all"}):
    try:
        Dataset(folder, **wrong)
    except ValueError:
        continue
    raise AssertionError(wrong)

((images, targets),) = DataLoader(found, batch_size=2, collate_fn=collate)
detector = faster(weights=None, weights_backbone=None, num_classes=3, min_size=64, max_size=96)
losses = detector(images, targets)
assert losses and all(torch.isfinite(loss) for loss in losses.values()), losses
print("torch: losses", {name: round(loss.item(), 3) for name, loss in losses.items()})
