"""Crop fields, rendered and labelled exactly: datasets from disk, and images from scene files.

    import furrow

    image = furrow.render("field", index=7, spp=16, width=648)    # runs the program `trace`
    crop = image["semantics"] == 1                                # 0 soil, 1 crop, 2 weed

    data = furrow.Dataset("data/d", split="train")                # a folder that `trace dataset` has made
    print(len(data), data[0]["plants"].max(), data[0]["record"]["conditions"]["camera"])

    for sample in furrow.stream("field", spp=16, width=324):      # one field after another, none of them written to disk
        train(sample["image"], sample["semantics"])

Needs numpy and Pillow. A `Dataset` goes into PyTorch's `DataLoader` as it is; `transform` chooses what a batch holds.
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
    """What the program said when it failed, or what a dataset lacks."""


class Sample(Dict[str, Any]):
    """One image with its labels, by name; a notebook shows its picture.

    ========== ======================= ==========================================================
    image      uint8, (H, W, 3)        the photograph in colour, from PNG or JPEG; none of labels alone
    nir        uint8, (H, W)           the one in near infrared, where there is one
    semantics  uint8, (H, W)           0 soil, 1 crop, 2 weed, 255 no label
    plants     int32, (H, W)           number of the plant, 0 for none; not there where `--keep` left it out
    leaves     int32, (H, W)           number of the leaf on its plant, 0 for none; likewise
    record     dict                    `record.json` of a dataset or a stream; of `render`, where the image came from
    ========== ======================= ==========================================================
    """

    def __missing__(self, key: str) -> Any:
        raise KeyError(f"{key}: this sample has no such map; its record tells plants and leaves with their masks")

    def _repr_png_(self) -> bytes:
        """The photograph, as notebooks show it; the classes where there is none."""
        out = io.BytesIO()
        shown = self["image"] if "image" in self else self["semantics"] * 127
        Image.fromarray(shown).save(out, "PNG")
        return out.getvalue()


def _read(file: Union[Path, IO[bytes]], kind: type[np.generic], name: object = None) -> np.ndarray[Any, Any]:
    """A picture's values, in memory that may be written; `name` is what errors call the file."""
    try:
        with Image.open(file) as picture:
            values = np.array(picture)
    # What Pillow raises for files that are no pictures, or are cut short.
    except (OSError, SyntaxError, ValueError) as error:
        raise Error(f"{name or file}: {error}") from error
    if kind is np.int32 and values.ndim == 3:
        # Numbers beyond 16 bits: R + 256 G + 65536 B.
        red, green, blue = (values[..., k].astype(kind) for k in range(3))
        return red | green << 8 | blue << 16
    return values.astype(kind)


def _object(text: Union[str, bytes], name: object) -> Dict[str, Any]:
    """What stands in JSON that holds an object."""
    try:
        found = json.loads(text)
    except ValueError as error:
        raise Error(f"{name}: {error}") from error
    if not isinstance(found, dict):
        raise Error(f"{name}: this is no JSON object")
    return found


def _json(path: Path) -> Dict[str, Any]:
    """What stands in a JSON file that holds an object."""
    try:
        return _object(path.read_text(encoding="utf-8"), path)
    except (OSError, UnicodeError) as error:
        raise Error(f"{path}: {error}") from error


# Names of pictures in a sample and as files, with the types of their values.
# Not the 16 bits of the files: PyTorch before 2.3 takes none without a sign.
_MAPS = (
    ("image", "rgb", np.uint8),
    ("nir", "nir", np.uint8),
    ("semantics", "semantics", np.uint8),
    ("plants", "plants", np.int32),
    ("leaves", "leaves", np.int32),
)

# Endings of the names of pictures: photographs may be either.
_ENDINGS = ("png", "jpg")


def _sample(folder: Path, photographs: str = "", left_out: Sequence[str] = (), ending: str = "png") -> Sample:
    """The pictures and labels of an image's folder; `left_out` are not read.

    `photographs` ends the names of other photographs than `rgb` and `nir`, `ending` the names of their files.
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
    """The images of a dataset, each read when it is asked for.

    `split` keeps those of "train", "val" or "test"; `transform` gets each `Sample` and its result is the item. PyTorch's own way to
    make batches takes numbers and arrays of one shape, so for it leave the record out:
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
            raise Error(f"{self.path} is no dataset: {error}") from error
        if split is not None and split not in SPLITS:
            raise ValueError(f"split is one of {', '.join(SPLITS)}, not {split!r}")
        # Of any so many fields in a row, the first are for training, then validation, then test.
        try:
            self._pattern = [name for name, share in zip(SPLITS, self.recipe["split"]) for _ in range(share)]
            self._captures = int(self.recipe["made"].get("rendered", {}).get("captures", 1))
            every = range(self.recipe["count"])
            self.indices = [k for k in every if split is None or self._split(k) == split]
            rendered = self.recipe["made"].get("rendered", {})
            self.labels_only = bool(rendered.get("labels_only"))
            # Recipes of before do not say what images keep: near infrared is among it. Imported ones may have it, too, unless theirs says no.
            imported = self.recipe["made"].get("imported", {})
            no_nir = self.labels_only or "nir" not in rendered.get("keep", ["nir"]) or imported.get("nir") is False
            self._left_out = list(rendered.get("omit", []))
            self._left_out += ["image"] * self.labels_only + ["nir"] * no_nir
            self._ending = "jpg" if str(rendered.get("photo", "png")).startswith("jpeg") else "png"
        except (AttributeError, KeyError, TypeError, ValueError, ZeroDivisionError) as error:
            raise Error(f"{self.path}/dataset.json is damaged: {error!r}") from error
        # Of packs that were read from: where each file lies.
        self._members: Dict[str, Dict[str, Tuple[int, int]]] = {}

    def __len__(self) -> int:
        return len(self.indices)

    def __getitem__(self, item: SupportsIndex) -> Any:
        index = self.indices[operator.index(item)]
        folder = self.path / "images" / f"{index:06d}"
        # A folder beside packs that is no whole image was put there.
        if self.recipe.get("pack") and not (folder / "record.json").is_file():
            sample = self._packed(index)
        else:
            sample = _sample(folder, left_out=self._left_out, ending=self._ending)
            sample["record"] = _json(folder / "record.json")
        return sample if self.transform is None else self.transform(sample)

    def _split(self, index: int) -> str:
        """The split of an image: all images of a field are in one."""
        return self._pattern[index // self._captures % len(self._pattern)]

    def _pack(self, index: int) -> str:
        """The name of the pack of an image: packs hold so many images of a split, in order."""
        split, (rounds, place) = self._split(index), divmod(index // self._captures, len(self._pattern))
        rank = rounds * self._pattern.count(split) + place - self._pattern.index(split)
        return f"{split}-{rank // max(self.recipe['pack'] // self._captures, 1):06d}"

    def _packed(self, index: int) -> Sample:
        """An image that lies in an archive with others."""
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
            raise Error(f"{archive}: image {index:06d} is not there yet")
        return _from_files(files, f"{archive}: {index:06d}", self._left_out)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"furrow.Dataset({str(self.path)!r}: {len(self)} images)"


def program() -> str:
    """The program `trace`: `$FURROW_TRACE`, then the one that came with this package, then the first on `$PATH`."""
    named = os.environ.get("FURROW_TRACE")
    own = (Path(__file__).parent.parent / "furrow.scripts/trace", Path(sysconfig.get_path("scripts")) / "trace")
    found = named or next((str(path) for path in own if path.is_file()), None) or shutil.which("trace")
    if not found:
        raise Error("there is no program `trace`: install Furrow, or name the program in FURROW_TRACE")
    return found


def _flags(flags: Dict[str, Any]) -> Sequence[str]:
    """`target_error=0.02, without=["mis"], denoise=True` as the program's command line writes it."""
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
    """Field `index` of a scene file, rendered with `spp` samples a pixel.

    `scene` is a file, or the name of one that ships, such as "field". Further keywords are the program's flags with `_` for `-`:
    `width=648`, `seed=3`, `crop=(0, 0, 200, 100)`, `denoise=True`; `target_error=0.05` or `time="30s"` want `spp=None`. With
    `denoise=True` the photographs are those without noise. Raises `Error` with the program's own words.
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
    """Names and contents of the files in a tar archive that is being written; ends where the archive does, or is cut."""
    # Not `tarfile.open`, which keeps a list of all files: an archive may go on for days.
    while header := archive.read(tarfile.BLOCKSIZE):
        try:
            entry = tarfile.TarInfo.frombuf(header, "utf-8", "strict")
        except tarfile.HeaderError:  # Zeros at the end, or a part of a header.
            return
        content = archive.read(entry.size)
        if len(content) < entry.size:
            return
        archive.read(-entry.size % tarfile.BLOCKSIZE)
        yield entry.name, content


def _from_files(files: Dict[str, bytes], key: str, left_out: Sequence[str] = ()) -> Sample:
    """A sample from the contents of its files, by their names; errors call it `key`, `left_out` are not read."""
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
    """The samples of an archive; of each image, the record is the last file."""
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
    """Fields of a scene file from number `first` on, each rendered shortly before it is asked for; without `count` they never end.

    Image k is the one that a dataset of the same scene file, size and samples has, its record included. With several readers, `shard`
    `(k, n)` gives each its own: reader k of n. Further keywords are the flags of `trace stream` with `_` for `-`: `width=324`, `seed=3`,
    `denoise=True`, `threads=2`; with `labels_only=True` `spp` says nothing. The program runs until the generator is closed or dropped. Raises `Error` with the program's own words.
    """
    # Only what becomes an array is encoded; of labels alone there are no samples, and nothing that they tell.
    drawn = {} if flags.get("labels_only") else {"keep": "nir", "spp": spp}
    chosen: Dict[str, Any] = {**drawn, "first": first, "count": count, **flags}
    if shard is not None:
        chosen["shard"] = "/".join(map(str, shard))
    command = [program(), "stream", "--quiet", "--scene", os.fspath(scene), *_flags(chosen)]
    # A file, which unlike a pipe takes any number of warnings.
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
                # Does nothing to a program that has ended.
                process.terminate()
        if failed:
            said.seek(0)
            raise Error(said.read().decode(errors="replace").strip() or f"{command[0]} ended with {process.returncode}")
