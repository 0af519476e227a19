"""Checks that the module `furrow` reads and renders the same as the program. Arguments: a dataset of two images, a folder."""

import io
import os
import shutil
import sys
from pathlib import Path

import furrow
import numpy as np
from PIL import Image

dataset, folder = map(Path, sys.argv[1:])
os.chdir(folder)

data = furrow.Dataset(dataset)
assert len(data) == 2 and "2 images" in repr(data), data
samples = list(data)
first = data[0]
names = ["image", "nir", "semantics", "plants", "leaves", "record"]
assert list(first) == names, list(first)
height, width = first["record"]["height"], first["record"]["width"]
assert first["image"].shape == (height, width, 3) and first["image"].dtype == np.uint8
for name in names[1:5]:
    assert first[name].shape == (height, width), name
    there = np.array(Image.open(dataset / f"images/000000/{'nir' if name == 'nir' else name}.png"))
    assert np.array_equal(first[name], there), name
assert first["plants"].dtype == first["leaves"].dtype == np.int32
assert {p["number"] for p in first["record"]["plants"] if p["seen"]["pixels"]} == set(np.unique(first["plants"])) - {0}
assert np.array_equal(data[-1]["image"], samples[1]["image"]) and not np.array_equal(first["image"], samples[1]["image"])
first["image"][:] = 0  # The caller owns the memory.
splits = [len(furrow.Dataset(dataset, split=name)) for name in ("train", "val", "test")]
assert splits == [1, 1, 0], splits
assert furrow.Dataset(dataset, split="val")[0]["record"]["split"] == "val"
assert furrow.Dataset(dataset, transform=lambda s: s["image"].mean())[0] > 0
for wrong, error in [(lambda: data[2], IndexError), (lambda: furrow.Dataset(folder), furrow.FurrowError)]:
    try:
        wrong()
    except error:
        pass
    else:
        raise AssertionError(error)

# Damaged files raise the module's own error with the position of the fault.
def told(path: str, content: bytes) -> str:
    copy = folder / "broken"
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(dataset, copy)
    (copy / path).write_bytes(content)
    try:
        furrow.Dataset(copy)[0]
    except furrow.FurrowError as error:
        return str(error)
    finally:
        shutil.rmtree(copy)
    raise AssertionError(path)


picture = (dataset / "images/000000/rgb.png").read_bytes()
for path, content in [
    ("images/000000/rgb.png", picture[: len(picture) // 2]),
    ("images/000000/rgb.png", b""),
    ("images/000000/record.json", b"{"),
    ("images/000000/record.json", b"[]"),
    ("dataset.json", b"[]"),
    ("dataset.json", b"{}"),
]:
    words = told(path, content)
    assert str(folder / "broken") in words and path.split("/")[-1] in words, words

# Rendering leaves no files behind, and equals the program's output for the same field.
rendered = furrow.render("field", index=1, spp=1, width=64)
assert rendered["image"].shape[1] == 64 and rendered.record["index"] == 1, rendered.record
assert not list(folder.iterdir()) or "out" not in [p.name for p in folder.iterdir()]
assert rendered.provenance["spp"] == "1" and rendered.provenance["index"] == "1", rendered.provenance
assert Image.open(io.BytesIO(rendered._repr_png_())).size[0] == 64
assert rendered._repr_html_().count("data:image/png;base64,") == 2
assert repr(rendered).startswith("furrow.Image(64 × 48, index 1, "), rendered
part = furrow.render("field", spp=1, width=64, crop=(0, 0, 20, 10), without=["mis"])
assert part["plants"].shape == (10, 20)
try:
    furrow.render("fild")
except furrow.FurrowError as error:
    assert "did you mean field" in str(error), error
else:
    raise AssertionError("a missing scene file was accepted")
os.environ["FURROW_TRACE"] = "/nowhere/trace"
try:
    furrow.render("field")
except furrow.FurrowError as error:
    assert "/nowhere/trace" in str(error), error
else:
    raise AssertionError("a missing program was accepted")
assert "torch" not in sys.modules
