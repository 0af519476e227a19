"""Reads a packed dataset with webdataset and Hugging Face's datasets, and its tables with pandas, polars and DuckDB."""

import io
import json
import sys
import tarfile
from pathlib import Path

import datasets
import duckdb
import numpy
import pandas
import PIL.Image
import polars
import webdataset

root = Path(sys.argv[1])
archives = sorted(str(path) for path in root.glob("packs/*.tar"))
records = {}
for path in archives:
    with tarfile.open(path) as archive:
        for name in archive.getnames():
            key, file = name.split(".", 1)
            if file == "record.json":
                records[key] = json.loads(archive.extractfile(name).read())
assert len(records) == 11, len(records)



def as_stored(key, data):
    return numpy.array(PIL.Image.open(io.BytesIO(data))) if key.endswith((".png", ".jpg")) else None


samples = list(webdataset.WebDataset(archives, shardshuffle=False).decode(as_stored))
assert sorted(sample["__key__"] for sample in samples) == sorted(records)
for sample in samples:
    record = records[sample["__key__"]]
    assert sample["rgb.png"].shape == (record["height"], record["width"], 3)
    assert sample["record.json"] == record
    # Label maps as the guide reads them: numbers, not colours.
    assert sample["plants.png"].dtype == numpy.uint16 and sample["semantics.png"].dtype == numpy.uint8
    shown = {plant["number"] for plant in record["plants"] if plant["seen"]["pixels"] > 0}
    assert set(sample["plants.png"].flat) - {0} == shown, (sample["__key__"], shown)
    assert set(sample["semantics.png"].flat) <= {0, 1, 2}

streamed = datasets.load_dataset("webdataset", data_files={"train": str(root / "packs/train-*.tar")}, split="train", streaming=True)
seen = {sample["__key__"]: sample for sample in streamed}
assert sorted(seen) == sorted(key for key, record in records.items() if record["split"] == "train"), sorted(seen)
first = next(iter(seen.values()))
assert first["rgb.png"].size == (48, records[first["__key__"]]["height"])

# Random access through the archive index.
for seal in root.glob("seals/*.json"):
    index = json.loads(seal.read_text())
    with open(root / "packs" / f"{index['pack']}.tar", "rb") as archive:
        for name, (offset, length) in index["members"].items():
            archive.seek(offset)
            content = archive.read(length)
            key, file = name.split(".", 1)
            assert file != "record.json" or json.loads(content) == records[key]

plants = [(record, plant) for _, record in sorted(records.items()) for plant in record["plants"]]
images, table = pandas.read_parquet(root / "images.parquet"), pandas.read_parquet(root / "plants.parquet")
assert list(images["image"]) == sorted(records) and len(table) == len(plants) > 0
assert list(table["visible_px"]) == [plant["seen"]["pixels"] for _, plant in plants]
assert list(table["species"]) == [plant["grown"]["eppo"] for _, plant in plants]
for row in images.to_dict("records"):
    record = records[row["image"]]
    shares = {share["class"]: share["pixels"] for share in record["classes"]}
    assert (row["soil_px"], row["crop_px"], row["weed_px"]) == (shares["soil"], shares["crop"], shares["weed"])
    assert row["split"] == record["split"] and (root / row["place"]).is_file()
    assert abs(row["camera_height_m"] - record["conditions"]["camera"]["position_m"][2]) < 1e-9
    assert pandas.isna(row["source"]) and pandas.isna(row["frame"])
other = polars.read_parquet(root / "plants.parquet")
assert other.shape == table.shape and other["visible_px"].to_list() == list(table["visible_px"])
assert other.schema["visible_px"] == polars.Int64 and other.schema["height_m"] == polars.Float32
code = plants[0][1]["grown"]["eppo"]
limit = sorted(plant["seen"]["pixels"] for _, plant in plants)[len(plants) // 2]
found = duckdb.sql(
    f"select image, plant from '{root}/plants.parquet' where species = '{code}' and visible_px < {limit}"
).fetchall()
expected = [
    (record["name"], plant["number"])
    for record, plant in plants
    if plant["grown"]["eppo"] == code and plant["seen"]["pixels"] < limit
]
assert sorted(found) == sorted(expected), (found, expected)
print(f"{len(samples)} images, {len(plants)} plants, {len(found)} of {code} below {limit} pixels")
