"""Predictions as annotations to correct in CVAT or Label Studio.

    train predict any-field photos/ --out predictions
    python -m furrow.annotate predictions --cvat masks.zip
    python -m furrow.annotate predictions --label-studio tasks.json --prefix /data/local-files/?d=photos/

CVAT imports the archive as "Segmentation mask 1.1" into a task with the same images. Label Studio imports the tasks into a
project with the labelling interface that is printed. The first class, soil, is the background of both.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import tempfile
import zipfile
from pathlib import Path
from typing import IO, Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
from PIL import Image as Picture

from ._errors import FurrowError, reported
from ._image import parsed

# Numbers of bits of run lengths in Label Studio's masks.
_SIZES = (3, 4, 8, 16)


class Prediction(NamedTuple):
    """Predicted classes of one image."""

    name: str
    picture: str
    classes: Any


class Predictions:
    """The folder that `train predict` wrote."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        path = folder / "prediction.json"
        try:
            about = parsed(path.read_text(encoding="utf-8"), path)
            self.classes: List[str] = [str(name) for name, _ in about["classes"]]
            colors = np.array([color for _, color in about["classes"]])
            if colors.shape != (len(self.classes), 3) or colors.min() < 0 or colors.max() > 255:
                raise ValueError("the colors of its classes are not red, green and blue from 0 to 255")
            self.colors: List[Tuple[int, ...]] = [(int(r), int(g), int(b)) for r, g, b in colors]
            self.pictures: Dict[str, str] = {str(name): str(picture) for name, picture in about["pictures"].items()}
            self.version = f"{about['network']} {about['weights_sha256'][:12]}"
        except OSError as error:
            help = "write them: train predict NETWORK IMAGES --out DIR"
            raise FurrowError(f"{folder} has no predictions: {error}", help=help) from error
        except (AttributeError, KeyError, OverflowError, TypeError, ValueError) as error:
            help = "restore it, or predict again with another --out"
            raise FurrowError(f"{path} is damaged: {error!r}", "damaged", help=help) from error

    def __iter__(self) -> Iterator[Prediction]:
        for name, picture in self.pictures.items():
            path = self.folder / f"{name}.png"
            try:
                classes = np.array(Picture.open(path))
                if classes.ndim != 2 or classes.dtype != np.uint8 or classes.max(initial=0) >= len(self.classes):
                    raise ValueError("it is not a mask of these classes")
            # Pillow raises SyntaxError for damaged PNG files.
            except (OSError, SyntaxError, ValueError, Picture.DecompressionBombError) as error:
                help = "restore it, or predict again with another --out"
                raise FurrowError(f"{path}: {error}", "damaged", help=help) from error
            yield Prediction(name, picture, classes)


@contextlib.contextmanager
def _replaced(path: Path) -> Iterator[IO[bytes]]:
    """Open a temporary file that becomes `path` if nothing fails, and is removed otherwise."""
    try:
        unfinished = tempfile.NamedTemporaryFile(dir=path.parent, prefix=".furrow-", delete=False)
    except (FileNotFoundError, NotADirectoryError, PermissionError) as error:
        help = "name a file in a folder in which you may write"
        raise FurrowError(f"{path} cannot be written: {error.strerror}", help=help) from error
    with unfinished as file:
        try:
            yield file
        except BaseException:
            os.unlink(file.name)
            raise
    os.chmod(file.name, 0o644)
    try:
        os.replace(file.name, path)
    except OSError as error:
        os.unlink(file.name)
        raise FurrowError(f"{path} cannot be replaced: {error.strerror}", help="name another file") from error


def cvat(predictions: Predictions, path: Path) -> None:
    """Write an archive that CVAT imports as "Segmentation mask 1.1": one coloured mask for each image."""
    colors = np.array([(0, 0, 0), *predictions.colors[1:]], np.uint8)
    names = ["background", *predictions.classes[1:]]
    lines = ["# label:color_rgb:parts:actions", *(f"{name}:{r},{g},{b}::" for name, (r, g, b) in zip(names, colors))]
    stems = []
    with _replaced(path) as unfinished, zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED) as archive:
        for found in predictions:
            stem = Path(found.picture).stem
            if stem in stems:
                help = "CVAT finds images by their names: predict them in several folders"
                raise FurrowError(f"{path}: two images have the name {stem}", help=help)
            stems.append(stem)
            mask = io.BytesIO()
            Picture.fromarray(colors[found.classes]).save(mask, "png")
            archive.writestr(f"SegmentationClass/{stem}.png", mask.getvalue())
        archive.writestr("labelmap.txt", "\n".join(lines) + "\n")
        archive.writestr("ImageSets/Segmentation/default.txt", "\n".join(stems) + "\n")


def label_studio(predictions: Predictions, path: Path, prefix: str = "") -> None:
    """Write tasks with brush masks. `prefix` and the file name make the address of each image."""
    tasks = []
    for found in predictions:
        height, width = found.classes.shape
        results = [
            {
                "id": f"{found.name}-{name}",
                "from_name": "label",
                "to_name": "image",
                "type": "brushlabels",
                "original_width": width,
                "original_height": height,
                "image_rotation": 0,
                "value": {"format": "rle", "rle": brush(found.classes == number), "brushlabels": [name]},
            }
            for number, name in enumerate(predictions.classes)
            if number > 0 and (found.classes == number).any()
        ]
        image = {"image": prefix + Path(found.picture).name}
        tasks.append({"data": image, "predictions": [{"model_version": predictions.version, "result": results}]})
    with _replaced(path) as unfinished:
        unfinished.write(json.dumps(tasks).encode())


def interface(predictions: Predictions) -> str:
    """Return the labelling interface of a Label Studio project for these classes."""
    rows = [
        f'    <Label value="{name}" background="#{r:02x}{g:02x}{b:02x}"/>'
        for name, (r, g, b) in zip(predictions.classes[1:], predictions.colors[1:])
    ]
    labels = "\n".join(['  <BrushLabels name="label" toName="image">', *rows, "  </BrushLabels>"])
    return f'<View>\n  <Image name="image" value="$image"/>\n{labels}\n</View>'


def brush(mask: Any) -> List[int]:
    """Encode a mask as Label Studio does: run lengths of the bytes of an RGBA image, packed into bits.

    The header holds the number of bytes (32 bits), the word size less 1 (5 bits) and four sizes of run lengths less 1 (4 bits
    each). A run is a 1, the index of its size (2 bits), its length less 1, and its value (8 bits).
    """
    values = mask.ravel().astype(np.uint8)
    starts = np.flatnonzero(np.diff(values, prepend=values[:1] ^ 1))
    lengths = 4 * np.diff(starts, append=values.size)
    bits = [f"{4 * values.size:032b}", f"{7:05b}", *(f"{size - 1:04b}" for size in _SIZES)]
    for value, length in zip(values[starts] * 255, lengths):
        while length > 0:
            part = min(int(length), 1 << _SIZES[-1])
            index = next(k for k, size in enumerate(_SIZES) if part <= 1 << size)
            bits.append(f"1{index:02b}{part - 1:0{_SIZES[index]}b}{value:08b}")
            length -= part
    text = "".join(bits)
    text += "0" * (-len(text) % 8)
    return [int(text[k : k + 8], 2) for k in range(0, len(text), 8)]


def main(arguments: Optional[Sequence[str]] = None) -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m furrow.annotate", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder that `train predict` wrote")
    parser.add_argument("--cvat", type=Path, metavar="ZIP", help="archive for CVAT: Segmentation mask 1.1")
    parser.add_argument("--label-studio", type=Path, metavar="JSON", help="tasks for Label Studio")
    parser.add_argument("--prefix", default="", help="address of the images for Label Studio, before their file names")
    chosen = parser.parse_args(arguments)
    if not (chosen.cvat or chosen.label_studio):
        parser.error("give --cvat ZIP or --label-studio JSON")
    with reported(parser):
        predictions = Predictions(chosen.folder)
        if chosen.cvat:
            cvat(predictions, chosen.cvat)
        if chosen.label_studio:
            label_studio(predictions, chosen.label_studio, chosen.prefix)
            print(interface(predictions))


if __name__ == "__main__":
    main()
