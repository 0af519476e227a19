"""Rendered crop fields with exact labels: datasets from disk, and images from scene files.

    import furrow

    image = furrow.render("field", index=7, spp=16, width=648)    # runs the program `trace`
    crop = image["semantics"] == 1                                # 0 soil, 1 crop, 2 weed

    data = furrow.Dataset("data/d", split="train")                # a folder written by `trace dataset`
    print(len(data), data[0]["plants"].max(), data[0]["record"]["conditions"]["camera"])

    for sample in furrow.stream("field", spp=16, width=324):      # one field after another, without writing to disk
        train(sample["image"], sample["semantics"])

Requires numpy and Pillow. A `Dataset` can be passed to PyTorch's `DataLoader`; `transform` selects the contents of a batch.
"""

from __future__ import annotations

import io
import json
import operator
import os
import shutil
import subprocess
import sysconfig
import tarfile
import tempfile
from pathlib import Path
from typing import IO, Any, Callable, Dict, Generator, Iterator, Optional, Sequence, SupportsIndex, Tuple, Union

import numpy as np
from PIL import Image

__all__ = ["Dataset", "Error", "Sample", "program", "render", "stream"]

SPLITS = ("train", "val", "test")


class Error(Exception):
    """Error message of the program, or a missing or damaged part of a dataset."""


class Sample(Dict[str, Any]):
    """One image with its labels, by name; notebooks display the image.

    ========== ======================= ==========================================================
    image      uint8, (H, W, 3)        colour image, from PNG or JPEG; absent for labels only
    nir        uint8, (H, W)           near-infrared image, if there is one
    semantics  uint8, (H, W)           0 soil, 1 crop, 2 weed, 255 no label
    plants     int32, (H, W)           number of the plant, 0 for none; absent if `--keep` omits it
    leaves     int32, (H, W)           number of the leaf on its plant, 0 for none; as above
    record     dict                    `record.json` of a dataset or stream; for `render`, the provenance of the image
    ========== ======================= ==========================================================
    """

    def __missing__(self, key: str) -> Any:
        raise KeyError(f"{key}: this sample has no such map; its record lists plants and leaves with their masks")

    def _repr_png_(self) -> bytes:
        """Return the image for display in notebooks, or the classes if there is none."""
        out = io.BytesIO()
        shown = self["image"] if "image" in self else self["semantics"] * 127
        Image.fromarray(shown).save(out, "PNG")
        return out.getvalue()


def _read(file: Union[Path, IO[bytes]], kind: type[np.generic], name: object = None) -> np.ndarray[Any, Any]:
    """Read an image into a writable array; errors refer to the file as `name`."""
    try:
        with Image.open(file) as picture:
            values = np.array(picture)
    # Raised by Pillow for files that are not images or are truncated.
    except (OSError, SyntaxError, ValueError) as error:
        raise Error(f"{name or file}: {error}") from error
    if kind is np.int32 and values.ndim == 3:
        # Numbers beyond 16 bits: R + 256 G + 65536 B.
        red, green, blue = (values[..., k].astype(kind) for k in range(3))
        return red | green << 8 | blue << 16
    return values.astype(kind)


def _object(text: Union[str, bytes], name: object) -> Dict[str, Any]:
    """Parse JSON that must be an object."""
    try:
        found = json.loads(text)
    except ValueError as error:
        raise Error(f"{name}: {error}") from error
    if not isinstance(found, dict):
        raise Error(f"{name}: this is not a JSON object")
    return found


def _json(path: Path) -> Dict[str, Any]:
    """Read a JSON file that must contain an object."""
    try:
        return _object(path.read_text(encoding="utf-8"), path)
    except (OSError, UnicodeError) as error:
        raise Error(f"{path}: {error}") from error


# Names of maps in a sample, their file names, and their value types.
# 32 bits instead of the 16 bits of the files, because PyTorch before 2.3 does not support unsigned 16-bit integers.
_MAPS = (
    ("image", "rgb", np.uint8),
    ("nir", "nir", np.uint8),
    ("semantics", "semantics", np.uint8),
    ("plants", "plants", np.int32),
    ("leaves", "leaves", np.int32),
)

# File name extensions of maps; images may have either.
_ENDINGS = ("png", "jpg")


def _sample(folder: Path, photographs: str = "", left_out: Sequence[str] = (), ending: str = "png") -> Sample:
    """Read the images and labels in the folder of an image, except the maps in `left_out`.

    `photographs` is a suffix of the names `rgb` and `nir`, such as "_denoised"; `ending` is their extension.
    """
    sample = Sample()
    for name, file, kind in _MAPS:
        if name in left_out:
            continue
        path = folder / (f"{file}{photographs}.{ending}" if name in ("image", "nir") else f"{file}.png")
        if name != "nir" or path.is_file():
            sample[name] = _read(path, kind)
    return sample


class Dataset:
    """The images of a dataset, each read on access.

    `split` selects "train", "val" or "test". `transform` is applied to each `Sample`, and its result is the item. PyTorch's
    default collation accepts only numbers and arrays of the same shape, so omit the record for it:
    `transform=lambda sample: (sample["image"], sample["semantics"])`.
    """

    def __init__(
        self,
        path: Union[str, "os.PathLike[str]"],
        split: Optional[str] = None,
        transform: Optional[Callable[[Sample], Any]] = None,
    ) -> None:
        self.path = Path(path)
        self.transform = transform
        try:
            self.recipe = _json(self.path / "dataset.json")
        except Error as error:
            raise Error(f"{self.path} is not a dataset: {error}") from error
        if split is not None and split not in SPLITS:
            raise ValueError(f"split must be one of {', '.join(SPLITS)}, not {split!r}")
        # Fields repeat the pattern of the split: first those for training, then validation, then test.
        try:
            self._pattern = [name for name, share in zip(SPLITS, self.recipe["split"]) for _ in range(share)]
            self._captures = int(self.recipe["made"].get("rendered", {}).get("captures", 1))
            every = range(self.recipe["count"])
            self.indices = [k for k in every if split is None or self._split(k) == split]
            rendered = self.recipe["made"].get("rendered", {})
            self.labels_only = bool(rendered.get("labels_only"))
            # Older recipes lack `keep`; their images have near infrared. Imported images may have it unless `nir` is false.
            imported = self.recipe["made"].get("imported", {})
            no_nir = self.labels_only or "nir" not in rendered.get("keep", ["nir"]) or imported.get("nir") is False
            self._left_out = list(rendered.get("omit", []))
            self._left_out += ["image"] * self.labels_only + ["nir"] * no_nir
            self._ending = "jpg" if str(rendered.get("photo", "png")).startswith("jpeg") else "png"
        except (AttributeError, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
            raise Error(f"{self.path}/dataset.json is damaged: {error!r}") from error
        # Offset and size of each file, by pack, for packs that have been read.
        self._members: Dict[str, Dict[str, Tuple[int, int]]] = {}

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, item: SupportsIndex) -> Any:
        index = self.indices[operator.index(item)]
        folder = self.path / "images" / f"{index:06d}"
        # A folder next to packs without a record is not an image of the dataset.
        if self.recipe.get("pack") and not (folder / "record.json").is_file():
            sample = self._packed(index)
        else:
            sample = _sample(folder, left_out=self._left_out, ending=self._ending)
            sample["record"] = _json(folder / "record.json")
        return sample if self.transform is None else self.transform(sample)

    def _split(self, index: int) -> str:
        """Return the split of an image; all images of a field are in the same one."""
        return self._pattern[index // self._captures % len(self._pattern)]

    def _pack(self, index: int) -> str:
        """Return the name of the pack of an image. A pack holds a fixed number of images of one split, in order."""
        split, (rounds, place) = self._split(index), divmod(index // self._captures, len(self._pattern))
        rank = rounds * self._pattern.count(split) + place - self._pattern.index(split)
        return f"{split}-{rank // max(self.recipe['pack'] // self._captures, 1):06d}"

    def _packed(self, index: int) -> Sample:
        """Read an image from a pack."""
        pack = self._pack(index)
        if pack not in self._members:
            self._members[pack] = _json(self.path / "seals" / f"{pack}.json").get("members", {})
        members, archive = self._members[pack], self.path / "packs" / f"{pack}.tar"
        files: Dict[str, bytes] = {}
        try:
            with open(archive, "rb") as tar:
                for name in [f"{file}.{ending}" for _, file, _ in _MAPS for ending in _ENDINGS] + ["record.json"]:
                    if place := members.get(f"{index:06d}.{name}"):
                        tar.seek(place[0])
                        files[name] = tar.read(place[1])
        except OSError as error:
            raise Error(f"{archive}: {error}") from error
        if "record.json" not in files:
            raise Error(f"{archive}: image {index:06d} does not exist yet")
        return _from_files(files, f"{archive}: {index:06d}", self._left_out)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"furrow.Dataset({str(self.path)!r}: {len(self)} images)"


def program() -> str:
    """Return the path of `trace`: `$FURROW_TRACE`, else the program in this package, else the first on `$PATH`."""
    named = os.environ.get("FURROW_TRACE")
    own = (Path(__file__).parent.parent / "furrow.scripts/trace", Path(sysconfig.get_path("scripts")) / "trace")
    found = named or next((str(path) for path in own if path.is_file()), None) or shutil.which("trace")
    if not found:
        raise Error("the program `trace` was not found: install Furrow, or set FURROW_TRACE to its path")
    return found


def _flags(flags: Dict[str, Any]) -> Sequence[str]:
    """Convert keywords such as `target_error=0.02, without=["mis"], denoise=True` to command-line arguments."""
    words = []
    for name, value in flags.items():
        if value is None or value is False:
            continue
        words.append("--" + name.replace("_", "-"))
        if isinstance(value, (list, tuple)):
            words.append(",".join(map(str, value)))
        elif value is not True:
            words.append(str(value))
    return words


def render(scene: Union[str, "os.PathLike[str]"], index: int = 0, spp: Optional[int] = 16, **flags: Any) -> Sample:
    """Render field `index` of a scene file with `spp` samples per pixel.

    `scene` is a file, or the name of a bundled one such as "field". Other keywords are the program's flags with `_` for `-`:
    `width=648`, `seed=3`, `crop=(0, 0, 200, 100)`, `denoise=True`; `target_error=0.05` or `time="30s"` need `spp=None`. With
    `denoise=True` the denoised images are returned. Raises `Error` with the program's error message.
    """
    with tempfile.TemporaryDirectory(prefix="furrow-") as folder:
        command = [program(), "--scene", os.fspath(scene), "--out", folder, "--quiet"]
        command += _flags({"index": index, "spp": spp, **flags})
        try:
            done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False)
        except OSError as error:
            raise Error(f"{command[0]}: {error}") from error
        if done.returncode != 0:
            raise Error(done.stderr.strip() or f"{command[0]} ended with {done.returncode}")
        sample = _sample(Path(folder), "_denoised" if flags.get("denoise") else "")
        with Image.open(Path(folder) / "rgb.png") as picture:
            comment = str(picture.info.get("Comment", ""))
        sample["record"] = dict(line.split(": ", 1) for line in comment.splitlines() if ": " in line)
        return sample


def _entries(archive: IO[bytes]) -> Iterator[Tuple[str, bytes]]:
    """Yield names and contents of the files in a tar stream, until it ends or is truncated."""
    # Not `tarfile.open`, which keeps a list of all files: a stream may last for days.
    while header := archive.read(tarfile.BLOCKSIZE):
        try:
            entry = tarfile.TarInfo.frombuf(header, "utf-8", "strict")
        except tarfile.HeaderError:  # Zeros at the end, or an incomplete header.
            return
        content = archive.read(entry.size)
        if len(content) < entry.size:
            return
        archive.read(-entry.size % tarfile.BLOCKSIZE)
        yield entry.name, content


def _from_files(files: Dict[str, bytes], key: str, left_out: Sequence[str] = ()) -> Sample:
    """Create a sample from its files' contents by name, except the maps in `left_out`; errors refer to it as `key`."""
    sample = Sample()
    for of, file, kind in _MAPS:
        if of in left_out:
            continue
        for name in (f"{file}.{ending}" for ending in _ENDINGS):
            if name in files:
                sample[of] = _read(io.BytesIO(files[name]), kind, f"{key}.{name}")
    sample["record"] = _object(files["record.json"], f"{key}.record.json")
    return sample


def _samples(archive: IO[bytes]) -> Iterator[Sample]:
    """Yield the samples of a tar stream; the record is the last file of each image."""
    files: Dict[str, bytes] = {}
    for path, content in _entries(archive):
        key, name = path.split(".", 1)
        files[name] = content
        if name == "record.json":
            yield _from_files(files, key)
            files = {}


def stream(
    scene: Union[str, "os.PathLike[str]"],
    spp: Optional[int] = 16,
    first: int = 0,
    count: Optional[int] = None,
    shard: Optional[Tuple[int, int]] = None,
    **flags: Any,
) -> Generator[Sample, None, None]:
    """Yield the fields of a scene file from index `first` on, each rendered shortly before use; endless without `count`.

    Image k, including its record, is the same as in a dataset with the same scene file, size and samples. With several readers,
    `shard=(k, n)` selects the images of reader k of n. Other keywords are the flags of `trace stream` with `_` for `-`:
    `width=324`, `seed=3`, `denoise=True`, `threads=2`; `labels_only=True` ignores `spp`. The program runs until the generator is
    closed or deleted. Raises `Error` with the program's error message.
    """
    # Encode only the maps that become arrays. With labels only, neither bands nor samples per pixel apply.
    drawn = {} if flags.get("labels_only") else {"keep": "nir", "spp": spp}
    chosen: Dict[str, Any] = {**drawn, "first": first, "count": count, **flags}
    if shard is not None:
        chosen["shard"] = "/".join(map(str, shard))
    command = [program(), "stream", "--quiet", "--scene", os.fspath(scene), *_flags(chosen)]
    # A file, because unlike a pipe it accepts any number of warnings without being read.
    with tempfile.TemporaryFile(prefix="furrow-") as said:
        try:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=said)
        except OSError as error:
            raise Error(f"{command[0]}: {error}") from error
        with process:
            assert process.stdout is not None
            try:
                yield from _samples(process.stdout)
                failed = process.wait() != 0
            finally:
                # Has no effect if the program has already ended.
                process.terminate()
        if failed:
            said.seek(0)
            raise Error(said.read().decode(errors="replace").strip() or f"{command[0]} ended with {process.returncode}")
