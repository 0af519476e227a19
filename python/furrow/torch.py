"""Datasets as tensors for PyTorch and torchvision.

    from furrow.torch import Dataset, collate
    from torch.utils.data import DataLoader

    data = Dataset("data/d", split="train", target="detection")
    for images, targets in DataLoader(data, batch_size=4, collate_fn=collate, num_workers=2):
        losses = model(images, targets)                  # torchvision's detectors

Requires PyTorch; the rest of the package does not import it.
"""

from __future__ import annotations

import os
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np
import torch  # type: ignore[import-not-found, unused-ignore]

from ._dataset import Dataset as _Folder
from ._errors import FurrowError
from ._image import Image

TARGETS = ("semantics", "plants", "detection")
CLASSES = {"crop": 1, "weed": 2}

Target = Union[torch.Tensor, Dict[str, torch.Tensor]]
Transforms = Callable[[torch.Tensor, Target], Tuple[Any, Any]]


class Dataset(torch.utils.data.Dataset[Tuple[Any, Any]]):  # type: ignore[misc, unused-ignore]
    """Pairs of image and target from a folder that `trace dataset` wrote.

    The image is a tensor of (3, height, width) with values from 0 to 1; `bands="rgbn"` adds near infrared as a fourth
    channel. `target` selects

    - "semantics": class of each pixel, int64: 0 soil, 1 crop, 2 weed, 255 no label (`ignore_index`);
    - "plants": number of the plant at each pixel, int64, 0 for none;
    - "detection": a dict of torchvision's detectors: `boxes` (x0, y0, x1, y1), `labels` (1 crop, 2 weed), `masks`,
      `area`, `iscrowd`, `image_id` of the visible plants.

    `transforms` takes and returns image and target, as in torchvision's own datasets.
    """

    def __init__(
        self,
        path: Union[str, "os.PathLike[str]"],
        split: Optional[str] = None,
        target: str = "semantics",
        bands: str = "rgb",
        transforms: Optional[Transforms] = None,
    ) -> None:
        if target not in TARGETS:
            raise ValueError(f"target must be one of {', '.join(TARGETS)}, not {target!r}")
        if bands not in ("rgb", "rgbn"):
            raise ValueError(f"bands must be rgb or rgbn, not {bands!r}")
        self.folder = _Folder(path, split=split)
        self.target, self.bands, self.transforms = target, bands, transforms

    def __len__(self) -> int:
        return len(self.folder)

    def __getitem__(self, item: int) -> Tuple[Any, Any]:
        sample = self.folder[item]
        image, target = self._image(sample), self._target(sample)
        return (image, target) if self.transforms is None else self.transforms(image, target)

    def _image(self, sample: Image) -> torch.Tensor:
        channels = [_band(sample, "image")]
        if self.bands == "rgbn":
            channels.append(_band(sample, "nir")[..., None])
        return torch.from_numpy(np.concatenate(channels, axis=2).transpose(2, 0, 1).copy()).float() / 255

    def _target(self, sample: Image) -> Target:
        if self.target == "detection":
            return detection(sample)
        return torch.from_numpy(sample[self.target].astype(np.int64))


def _band(sample: Image, name: str) -> Any:
    if name not in sample:
        raise FurrowError(f"the images of this dataset have no {name}", "misuse")
    return sample[name]


def detection(sample: Image) -> Dict[str, torch.Tensor]:
    """Return the visible plants of an image as torchvision's detectors expect them."""
    seen = [plant for plant in sample["record"]["plants"] if plant["seen"]["pixels"] > 0]
    boxes = np.array([plant["seen"]["box"] for plant in seen], np.float32).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    numbers = np.array([plant["number"] for plant in seen], np.int64).reshape(-1, 1, 1)
    return {
        "boxes": torch.from_numpy(boxes),
        "labels": torch.tensor([CLASSES[plant["class"]] for plant in seen], dtype=torch.int64),
        "masks": torch.from_numpy((sample["plants"][None] == numbers).astype(np.uint8)),
        "area": torch.tensor([plant["seen"]["pixels"] for plant in seen], dtype=torch.float32),
        "iscrowd": torch.zeros(len(seen), dtype=torch.int64),
        "image_id": torch.tensor(sample["record"]["index"], dtype=torch.int64),
    }


def collate(batch: Sequence[Tuple[Any, Any]]) -> Tuple[List[Any], List[Any]]:
    """Return images and targets of a batch as two lists, since the numbers of plants differ."""
    images, targets = zip(*batch)
    return list(images), list(targets)
