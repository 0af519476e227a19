"""Opens DATASET/amodal with pycocotools: whole masks contain the visible ones, their pixels are those counted in the records, and hidden pixels show something in front."""

import sys
from pathlib import Path

import numpy as np
from pycocotools import mask as rle
from pycocotools.coco import COCO

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
plants = hidden = partly = 0
for split in native.SPLITS:
    path = dataset / f"amodal/annotations/instances_{split}.json"
    assert path.exists() == bool(native.of_split(images, split))
    if not path.exists():
        continue
    coco = COCO(str(path))
    assert sorted(coco.getAnnIds()) == list(range(1, len(coco.anns) + 1))
    for about in coco.loadImgs(coco.getImgIds()):
        own = images[about["file_name"].removesuffix(".png")]
        found = {a["attributes"]["plant"]: a for a in coco.loadAnns(coco.getAnnIds(imgIds=about["id"]))}
        assert sorted(found) == [p["number"] for p in own.record["plants"]]
        for plant in own.record["plants"]:
            annotation, seen = found[plant["number"]], plant["seen"]
            assert coco.cats[annotation["category_id"]]["name"] == plant["class"]
            whole = coco.annToMask(annotation).astype(bool)
            visible, invisible = (rle.decode(annotation[key]).astype(bool) for key in ("visible_mask", "invisible_mask"))
            assert np.array_equal(visible, own.plant_mask(plant))
            assert np.array_equal(whole, visible | invisible) and not (visible & invisible).any()
            assert whole.sum() == annotation["area"] == seen["unoccluded"] and visible.sum() == seen["pixels"]
            assert abs(annotation["occlude_rate"] - invisible.sum() / whole.sum()) < 1e-9
            ys, xs = np.where(whole)
            assert annotation["bbox"] == [xs.min(), ys.min(), xs.max() + 1 - xs.min(), ys.max() + 1 - ys.min()]
            plants += 1
            hidden += not visible.any()
            partly += bool(visible.any() and invisible.any())
if plants:
    assert partly > 0
print(f"amodal: {plants} plants, {partly} partly and {hidden} fully hidden")
