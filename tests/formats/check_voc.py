"""Reads Pascal VOC with torchvision: boxes and masks equal those of the native files."""

import sys
from pathlib import Path

import numpy as np
from torchvision.datasets import VOCDetection, VOCSegmentation

sys.path.insert(0, str(Path(__file__).parent))
import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
seen = 0
for split in ("train", "val"):
    expected = native.of_split(images, split)
    segmentation = VOCSegmentation(dataset / "voc", year="2012", image_set=split)
    detection = VOCDetection(dataset / "voc", year="2012", image_set=split)
    assert len(segmentation) == len(detection) == len(expected), split
    for image, (photograph, mask), (_, annotation) in zip(expected, segmentation, detection):
        annotation = annotation["annotation"]
        assert annotation["filename"] == f"{image.name}.jpg"
        far = np.abs(np.array(photograph).astype(int) - image.rgb.astype(int)).mean()
        assert far < 6, far
        assert (np.array(mask) == image.semantics).all()
        objects = native.picture(dataset / f"voc/VOCdevkit/VOC2012/SegmentationObject/{image.name}.png")
        plants = image.seen()
        found = annotation.get("object", [])
        assert len(found) == len(plants), (len(found), len(plants))
        for number, (plant, told) in enumerate(zip(plants, found), 1):
            x, y, w, h = plant["seen"]["box"]
            box = [int(told["bndbox"][side]) for side in ("xmin", "ymin", "xmax", "ymax")]
            assert box == [x + 1, y + 1, x + w, y + h] and told["name"] == plant["class"]
            assert ((objects == min(number, 255)) == image.plant_mask(plant)).all()
            seen += 1
print(f"{len(images)} images, {seen} plants")
