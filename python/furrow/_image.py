"""Images with their labels as arrays."""

from __future__ import annotations

import base64
import io
import json
from pathlib import Path
from typing import IO, Any, Dict, Sequence, Union

import numpy as np
from PIL import Image as Pillow

from ._errors import FurrowError

Array = np.ndarray[Any, Any]

# Colours of soil, crop, weed, and of pixels without a label.
_COLORS = np.array([[128, 102, 77], [51, 179, 51], [217, 51, 51]] + [[0, 0, 0]] * 253, dtype=np.uint8)


class Image(Dict[str, Any]):
    """One image with its labels: a dict whose values are attributes too. Notebooks display it.

    =================== ================= ==========================================================
    `rgb`, ["image"]    uint8, (H, W, 3)  colour image; absent for labels only
    `nir`               uint8, (H, W)     near-infrared image, if there is one
    `semantics`         uint8, (H, W)     0 soil, 1 crop, 2 weed, 255 no label
    `plants`            int32, (H, W)     number of the plant, 0 for none; absent if `keep` omits it
    `leaves`            int32, (H, W)     number of the leaf on its plant, 0 for none; as above
    `depth`             float32, (H, W)   distance along the optical axis, metres; of `render` only
    `record`            dict              `record.json` of a dataset: plants, boxes, masks, conditions
    `provenance`        dict              program, hash of the scene, seed, samples; of `render` only
    =================== ================= ==========================================================
    """

    def __missing__(self, key: str) -> Any:
        if key == "depth":
            raise KeyError("depth: only `render` returns it; a dataset that keeps it has it in `geometry.exr`, channel `depth.Z`")
        raise KeyError(f"{key}: this image has no such map; its record lists plants and leaves with their masks")

    @property
    def rgb(self) -> Array:
        """Colour image."""
        return self._map("image")

    @property
    def nir(self) -> Array:
        """Near-infrared image."""
        return self._map("nir")

    @property
    def semantics(self) -> Array:
        """Class of each pixel."""
        return self._map("semantics")

    @property
    def plants(self) -> Array:
        """Plant of each pixel."""
        return self._map("plants")

    @property
    def leaves(self) -> Array:
        """Leaf of each pixel."""
        return self._map("leaves")

    @property
    def depth(self) -> Array:
        """Distance of each pixel."""
        return self._map("depth")

    @property
    def record(self) -> Dict[str, Any]:
        """Labels and conditions of the image."""
        found: Dict[str, Any] = self["record"]
        return found

    @property
    def provenance(self) -> Dict[str, str]:
        """Origin of the image."""
        found: Dict[str, str] = self["provenance"]
        return found

    def _map(self, name: str) -> Array:
        found: Array = self[name]
        return found

    def _shown(self) -> Array:
        shown: Array = self["image"] if "image" in self else _COLORS[self["semantics"]]
        return shown

    def _repr_png_(self) -> bytes:
        """Return the image for display in notebooks, or the classes if there is none."""
        return _png(self._shown())

    def _repr_html_(self) -> str:
        """Return image and classes side by side for display in notebooks."""
        views = [self._shown()] + ([_COLORS[self["semantics"]]] if "image" in self and "semantics" in self else [])
        each = "".join(
            f'<img style="max-width:49%" src="data:image/png;base64,{base64.b64encode(_png(view)).decode()}">'
            for view in views
        )
        return f"<figure>{each}<figcaption>{self._words()}</figcaption></figure>"

    def _words(self) -> str:
        height, width = self._shown().shape[:2]
        words = [f"{width} × {height}"]
        if "record" in self:
            words.append(f"index {self.record.get('index')}")
            if "plants" in self.record:
                words.append(f"{sum(plant['seen']['pixels'] > 0 for plant in self.record['plants'])} plants")
        return ", ".join(words)

    def __repr__(self) -> str:
        return f"furrow.Image({self._words()})"


def _png(pixels: Array) -> bytes:
    out = io.BytesIO()
    Pillow.fromarray(pixels).save(out, "PNG")
    return out.getvalue()


def read(file: Union[Path, IO[bytes]], kind: type[np.generic], name: object = None) -> Array:
    """Read an image into a writable array; errors refer to the file as `name`."""
    try:
        with Pillow.open(file) as picture:
            values = np.array(picture)
    # Raised by Pillow for files that are not images or are truncated.
    except (OSError, SyntaxError, ValueError) as error:
        raise FurrowError(f"{name or file}: {error}", "damaged") from error
    if kind is np.int32 and values.ndim == 3:
        # Numbers beyond 16 bits: R + 256 G + 65536 B.
        red, green, blue = (values[..., k].astype(kind) for k in range(3))
        return red | green << 8 | blue << 16
    return values.astype(kind)


def parsed(text: Union[str, bytes], name: object) -> Dict[str, Any]:
    """Parse JSON that must be an object."""
    try:
        found = json.loads(text)
    except ValueError as error:
        raise FurrowError(f"{name}: {error}", "damaged") from error
    if not isinstance(found, dict):
        raise FurrowError(f"{name}: this is not a JSON object", "damaged")
    return found


# Names of maps in an image, their file names, and their value types.
# 32 bits instead of the 16 bits of the files, because PyTorch before 2.3 does not support unsigned 16-bit integers.
MAPS = (
    ("image", "rgb", np.uint8),
    ("nir", "nir", np.uint8),
    ("semantics", "semantics", np.uint8),
    ("plants", "plants", np.int32),
    ("leaves", "leaves", np.int32),
)

# File name extensions of maps; images may have either.
ENDINGS = ("png", "jpg")


def from_folder(folder: Path, left_out: Sequence[str], ending: str) -> Image:
    """Read the images and labels in the folder of an image, except the maps in `left_out`; photographs have this ending."""
    image = Image()
    if not folder.is_dir():
        raise FurrowError(f"{folder}: this image is not rendered yet: run `trace dataset render` in its dataset", "missing")
    for name, file, kind in MAPS:
        if name in left_out:
            continue
        path = folder / (f"{file}.{ending}" if name in ("image", "nir") else f"{file}.png")
        if name != "nir" or path.is_file():
            image[name] = read(path, kind)
    return image


def from_files(files: Dict[str, bytes], key: str, left_out: Sequence[str] = ()) -> Image:
    """Create an image from its files' contents by name, except the maps in `left_out`; errors refer to it as `key`."""
    image = Image()
    for of, file, kind in MAPS:
        if of in left_out:
            continue
        for name in (f"{file}.{ending}" for ending in ENDINGS):
            if name in files:
                image[of] = read(io.BytesIO(files[name]), kind, f"{key}.{name}")
    image["record"] = parsed(files["record.json"], f"{key}.record.json")
    return image
