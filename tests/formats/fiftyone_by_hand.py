"""Opens DATASET/coco and DATASET/amodal in FiftyOne as docs/guide/python.md says, and compares samples, boxes, masks and classes with the COCO
files; then starts the app and asks it for its page. Not part of the tests: FiftyOne brings a database server and half a gigabyte of packages.

    trace dataset --scene field --count 3 --width 96 --spp 1 --format coco,amodal --out DATASET
    python3 -m venv V && V/bin/pip install fiftyone pycocotools && V/bin/python tests/formats/fiftyone_by_hand.py DATASET

FiftyOne downloads MongoDB from mongodb.org when it is installed. Where that is not reachable: FIFTYONE_DATABASE_URI of a server of your own,
and FIFTYONE_DATABASE_VALIDATION=false if it is older than FiftyOne wants. Last run: FiftyOne 1.22.1, MongoDB 5.0.32, 3 samples, 123 objects of
`coco`, 128 of `amodal`.
"""

import json
import os
import sys
import tempfile
import urllib.request
from pathlib import Path

# A database of its own: what the user keeps in FiftyOne stays as it is. No usage statistics are sent.
place = tempfile.TemporaryDirectory(prefix="fiftyone")
os.environ.update(FIFTYONE_DATABASE_DIR=place.name, FIFTYONE_DO_NOT_TRACK="true")

import fiftyone as fo
import numpy as np
from pycocotools.coco import COCO


def check(folder):
    """Reads a folder of `--format coco` or `amodal`; returns FiftyOne's dataset and the number of its objects."""
    labels = folder / "annotations/instances_train.json"
    data = fo.Dataset.from_dir(dataset_type=fo.types.COCODetectionDataset, data_path=str(folder / "images/train"),
                               labels_path=str(labels), label_types="segmentations")
    coco = COCO(labels)
    truth = json.loads(labels.read_text())
    images = {image["file_name"]: image for image in truth["images"]}
    names = {category["id"]: category["name"] for category in truth["categories"]}
    assert len(data) == len(images) > 0
    objects = 0
    for sample in data:
        image = images.pop(Path(sample.filepath).name)
        expected = coco.loadAnns(coco.getAnnIds(image["id"]))
        found = sample.ground_truth.detections if sample.ground_truth else []
        assert len(found) == len(expected), (image, len(found), len(expected))
        objects += len(found)
        for one, annotation in zip(found, expected):
            assert one.label == names[annotation["category_id"]]
            x, y, width, height = annotation["bbox"]
            box = np.array(one.bounding_box) * ([image["width"], image["height"]] * 2)
            assert np.allclose(box, [x, y, width, height], atol=1e-6), (box, annotation["bbox"])
            # FiftyOne keeps the part of a mask that is in its box.
            whole = coco.annToMask(annotation)
            part = whole[int(y):int(y + height), int(x):int(x + width)]
            assert np.array_equal(one.mask, part) and part.sum() == whole.sum(), annotation["id"]
    assert not images and objects == len(truth["annotations"]) > 0
    print(f"{folder.name}: {len(data)} samples, {objects} objects")
    return data


dataset = Path(sys.argv[1])
check(dataset / "amodal")
session = fo.launch_app(check(dataset / "coco"), auto=False)
with urllib.request.urlopen(f"http://localhost:{session.server_port}/", timeout=60) as answer:
    assert answer.status == 200 and b"FiftyOne" in answer.read()
session.close()
print("FiftyOne", fo.__version__)
