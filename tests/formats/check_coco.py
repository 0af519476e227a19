"""Opens DATASET/coco with pycocotools and compares masks, boxes and keypoints with the native maps. The truth evaluated against itself has perfect scores."""

import sys
from pathlib import Path

import numpy as np
from pycocotools.coco import COCO
from pycocotools.cocoeval import COCOeval

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
STATES = {"visible": 2, "hidden": 1, "outside": 0}
plants = leaves = 0
states = {0: 0, 1: 0, 2: 0}


def point(keypoint):
    """x, y, v of one of our keypoints; zeros if it is missing."""
    state = STATES[keypoint["state"]] if keypoint else 0
    return (keypoint["x"], keypoint["y"], state) if state else (0, 0, 0)


def same(coco, annotation, mask, seen, points):
    assert annotation["iscrowd"] == 0 and annotation["id"] > 0
    assert np.array_equal(coco.annToMask(annotation), mask)
    assert annotation["area"] == seen["pixels"] == mask.sum()
    ys, xs = np.where(mask)
    box = [xs.min(), ys.min(), xs.max() + 1 - xs.min(), ys.max() + 1 - ys.min()]
    assert annotation["bbox"] == box == seen["box"]
    written = np.array(annotation["keypoints"]).reshape(-1, 3)
    expected = np.array([point(p) for p in points])
    assert np.abs(written - expected).max() <= 0.0051
    assert annotation["num_keypoints"] == (expected[:, 2] > 0).sum()
    for v in written[:, 2]:
        states[int(v)] += 1


def judge(coco, kind, most, **settings):
    """Runs COCOeval of the truth against itself; precision and recall at the largest number of detections must be 1."""
    truth = [dict(a, score=1.0) for a in coco.dataset["annotations"]]
    if kind == "keypoints":
        truth = [a for a in truth if a["num_keypoints"] > 0]
    if not truth:
        return
    answers = coco.loadRes(truth)
    judge = COCOeval(coco, answers, kind)
    judge.params.maxDets = most
    judge.params.areaRng, judge.params.areaRngLbl = [[0, 1e10]], ["all"]
    for name, value in settings.items():
        setattr(judge.params, name, np.array(value))
    judge.evaluate()
    judge.accumulate()
    precision, recall = judge.eval["precision"][..., -1], judge.eval["recall"][..., -1]
    # COCOeval divides by a sum plus machine epsilon, so the precision is not exactly 1.
    assert (precision > -1).any() and np.allclose(precision[precision > -1], 1, atol=1e-12)
    assert (recall[recall > -1] == 1).all()


# COCOeval's default detection limits suit plants; keypoints need a single limit.
DEFAULT = [1, 10, 100]
ALL = [1, 100, 10000]

for split in native.SPLITS:
    paths = [dataset / f"coco/annotations/{name}_{split}.json" for name in ["instances", "leaves"]]
    own_images = native.of_split(images, split)
    assert [path.exists() for path in paths] == [bool(own_images)] * 2
    if not own_images:
        continue
    of_plants, of_leaves = [COCO(str(path)) for path in paths]
    assert [c["name"] for c in of_plants.loadCats(of_plants.getCatIds())] == ["crop", "weed"]
    assert [c["name"] for c in of_leaves.loadCats(of_leaves.getCatIds())] == ["leaf"]
    assert of_plants.dataset["images"] == of_leaves.dataset["images"]
    for coco in [of_plants, of_leaves]:
        assert sorted(coco.getAnnIds()) == list(range(1, len(coco.anns) + 1))
    assert len(of_plants.getImgIds()) == len(own_images)
    for image in of_plants.loadImgs(of_plants.getImgIds()):
        own = images[image["file_name"].removesuffix(".png")]
        assert (image["height"], image["width"]) == own.semantics.shape
        assert np.array_equal(native.picture(dataset / "coco/images" / split / image["file_name"]), own.rgb)
        found = [coco.loadAnns(coco.getAnnIds(imgIds=image["id"])) for coco in [of_plants, of_leaves]]
        by_key = {(a["attributes"]["plant"], a["attributes"].get("leaf", 0)): a for a in found[0] + found[1]}
        assert len(by_key) == len(found[0]) + len(found[1])
        assert (len(found[0]), len(found[1])) == (len(own.seen()), len(own.seen_leaves()))
        for plant in own.seen():
            annotation = by_key[plant["number"], 0]
            assert of_plants.cats[annotation["category_id"]]["name"] == plant["class"]
            assert annotation["attributes"]["species"] == plant["grown"]["species"]
            same(of_plants, annotation, own.plant_mask(plant), plant["seen"], [plant.get("stem")])
            plants += 1
        for plant, leaf in own.seen_leaves():
            annotation = by_key[plant["number"], leaf["number"]]
            same(of_leaves, annotation, own.leaf_mask(plant, leaf), leaf["seen"], [leaf.get("base"), leaf.get("tip")])
            leaves += 1
    for coco, most, sigmas in [(of_plants, DEFAULT, [0.05]), (of_leaves, ALL, [0.05, 0.05])]:
        judge(coco, "segm", most)
        judge(coco, "bbox", most)
        judge(coco, "keypoints", [20] if coco is of_plants else ALL, kpt_oks_sigmas=sigmas)

print(f"coco: {plants} plants, {leaves} leaves, points by state {states}")
