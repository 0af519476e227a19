"""Datasets on disk."""

from __future__ import annotations

import operator
import os
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, Optional, SupportsIndex, Tuple, Union

from ._errors import FurrowError
from ._image import ENDINGS, MAPS, Image, from_files, from_folder, parsed

SPLITS = ("train", "val", "test")


def _json(path: Path) -> Dict[str, Any]:
    """Read a JSON file that must contain an object."""
    try:
        return parsed(path.read_text(encoding="utf-8"), path)
    except (OSError, UnicodeError) as error:
        raise FurrowError(f"{path}: {error}") from error


class Dataset:
    """The images of a dataset, each read on access.

    `split` selects "train", "val" or "test". `transform` is applied to each `Image`, and its result is the item. PyTorch's
    default collation accepts only numbers and arrays of the same shape, so omit the record for it:
    `transform=lambda sample: (sample["image"], sample["semantics"])`.
    """

    def __init__(
        self,
        path: Union[str, "os.PathLike[str]"],
        split: Optional[str] = None,
        transform: Optional[Callable[[Image], Any]] = None,
    ) -> None:
        self.path = Path(path)
        self.transform = transform
        try:
            self.recipe = _json(self.path / "dataset.json")
        except FurrowError as error:
            raise FurrowError(f"{self.path} is not a dataset: {error}") from error
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
            raise FurrowError(f"{self.path}/dataset.json is damaged: {error!r}", "damaged") from error
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
            sample = from_folder(folder, self._left_out, self._ending)
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

    def _packed(self, index: int) -> Image:
        """Read an image from a pack."""
        pack = self._pack(index)
        if pack not in self._members:
            seal = self.path / "seals" / f"{pack}.json"
            if not seal.is_file():
                raise FurrowError(f"{seal}: the pack of image {index:06d} is not complete: run `trace dataset render`", "missing")
            self._members[pack] = _json(seal).get("members", {})
        members, archive = self._members[pack], self.path / "packs" / f"{pack}.tar"
        files: Dict[str, bytes] = {}
        try:
            with open(archive, "rb") as tar:
                for name in [f"{file}.{ending}" for _, file, _ in MAPS for ending in ENDINGS] + ["record.json"]:
                    if place := members.get(f"{index:06d}.{name}"):
                        tar.seek(place[0])
                        files[name] = tar.read(place[1])
        except OSError as error:
            raise FurrowError(f"{archive}: {error}") from error
        if "record.json" not in files:
            raise FurrowError(f"{archive}: image {index:06d} is not rendered yet: run `trace dataset render`", "missing")
        return from_files(files, f"{archive}: {index:06d}", self._left_out)

    def __iter__(self) -> Iterator[Any]:
        return (self[k] for k in range(len(self)))

    def __repr__(self) -> str:
        return f"furrow.Dataset({str(self.path)!r}: {len(self)} images)"
