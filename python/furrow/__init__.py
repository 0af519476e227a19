"""Rendered crop fields with exact labels: scenes as nested dicts, images as arrays, datasets from disk.

    import furrow as fw

    scene = fw.load("field")                             # a scene file, or a bundled one by its name
    scene["camera"]["height_m"] = 1.2
    scene["crops"][0]["species"] = "maize"
    image = scene.render(seed=7, spp=32)
    crop = image.semantics == 1                          # 0 soil, 1 crop, 2 weed

    for image in scene.stream(count=1000, seed=1):       # one field after the other, without writing to disk
        train(image.rgb, image.semantics)

    data = fw.Dataset("data/d", split="train")           # a folder written by `trace dataset`
    print(len(data), data[0].plants.max(), data[0].record["conditions"]["camera"])

Requires numpy and Pillow. A `Dataset` can be passed to PyTorch's `DataLoader`; `transform` selects the contents of a batch.
`furrow.torch` returns tensors and the targets of torchvision's detectors.
"""

from ._dataset import Dataset
from ._distribute import distribute
from ._errors import FurrowError, FurrowWarning, Place
from ._image import Image
from ._program import program
from ._scene import RenderOptions, Scene, StreamOptions, load, render, stream

__all__ = [
    "Dataset",
    "FurrowError",
    "FurrowWarning",
    "Image",
    "Place",
    "RenderOptions",
    "Scene",
    "StreamOptions",
    "distribute",
    "load",
    "program",
    "render",
    "stream",
]
