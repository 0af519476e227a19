"""Opens DATASET/yolo and DATASET/yolo-detect with supervision and compares classes, boxes and masks with the native maps."""

import sys
from pathlib import Path

import numpy as np
import supervision as sv
import yaml

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
plants = 0

for name in ["yolo", "yolo-detect"]:
    root = dataset / name
    data = yaml.safe_load((root / "data.yaml").read_text())
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
            force_masks=name == "yolo",
        )
        assert read.classes == ["crop", "weed"] and len(read) == len(own_images)
        for path, image, detections in read:
            own = images[Path(path).stem]
            assert np.array_equal(image[..., ::-1], own.rgb)
            assert len(detections) == len(own.seen())
            for i, plant in enumerate(own.seen()):
                assert read.classes[detections.class_id[i]] == plant["class"]
                x, y, w, h = plant["seen"]["box"]
                # Six digits: within a hundredth of a pixel.
                assert np.abs(detections.xyxy[i] - [x, y, x + w, y + h]).max() < 0.02
                if name == "yolo":
                    # supervision rounds vertices, so it rasterizes more pixels and clips at the border; no pixel of the
                    # plant is lost.
                    assert (detections.mask[i] | ~own.plant_mask(plant)).all()
                plants += 1

print(f"yolo: {plants} plants")
