"""Opens DATASET/imagefolder with Hugging Face datasets and compares images and columns with the native maps and records."""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

dataset = Path(sys.argv[1])
cache = tempfile.TemporaryDirectory()
os.environ["HF_HOME"] = cache.name

import datasets
import yaml

import native

images = native.read(dataset)
root = dataset / "imagefolder"
species = [s["name"] for s in __import__("json").loads((dataset / "dataset.json").read_text())["species"]]
NAMES = {"train": "train", "val": "validation", "test": "test"}

card = (root / "README.md").read_text()
head = yaml.safe_load(card.split("---")[1])
assert head["license"] == "cc-by-4.0"

for read in (datasets.load_dataset(str(root)), datasets.load_dataset("imagefolder", data_dir=str(root))):
    assert set(read) == {NAMES[split] for split in NAMES if native.of_split(images, split)}
    for split, name in NAMES.items():
        if name not in read:
            continue
        rows = read[name]
        assert len(rows) == len(native.of_split(images, split))
        for row in rows:
            own = images[f"{row['index']:06}"]
            record = own.record
            assert own.split == split
            assert np.array_equal(np.array(row["image"]), own.rgb)
            assert np.array_equal(np.array(row["mask"]), own.semantics)
            # 16 bit: plant numbers are not truncated to 8 bits.
            assert row["plants"].mode == "I;16" and np.array_equal(np.array(row["plants"]), own.plants)
            assert np.array_equal(np.array(row["leaves"]), own.leaves)
            folder = dataset / "images" / own.name
            assert np.array_equal(np.array(row["nir"]), native.picture(folder / "nir.png"))
            assert np.array_equal(np.array(row["species"]), native.picture(folder / "species.png"))
            pixels = [row["soil_pixels"], row["crop_pixels"], row["weed_pixels"]]
            assert pixels == [(own.semantics == n).sum() for n in range(3)]
            assert row["crops"] + row["weeds"] == len(own.seen()) and row["leaves_seen"] == len(own.seen_leaves())
            names = {species[p["kind"] - 1] for p in own.seen()}
            assert row["species_names"] == ", ".join(sorted(names))
            sky = record["conditions"]["lights"][0]
            assert row["light"] == sky["kind"] == "daylight"
            assert row["sun_elevation_deg"] == sky["sun_elevation_deg"]
            assert row["sun_azimuth_deg"] == sky["sun_azimuth_deg"]
            sun, rest = sum(sky["sun_irradiance_w_m2_nm"][:3]), sum(sky["sky_irradiance_w_m2_nm"][:3])
            assert abs(row["sun_share"] - sun / (sun + rest)) < 1e-6
            assert row["soil_moisture"] == record["conditions"]["soil"]["moisture"]["mean"]
            assert row["soil"] == "dirt.png" and 0 < row["camera_height_m"] < 1

print(f"imagefolder: {len(images)} images, {len(rows.column_names)} columns")
