"""Reads DATASET/traits with pandas and compares its rows with the records, and its areas with the label maps."""

import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pandas as pd

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
read = lambda name: pd.read_csv(dataset / "traits" / name, dtype={"image": str})
plants, leaves, views = read("plants.csv"), read("leaves.csv"), read("images.csv")

assert list(views["image"]) == list(images)
assert len(plants) == sum(len(i.record["plants"]) for i in images.values())
assert len(leaves) == sum(len(p["leaves"]) for i in images.values() for p in i.record["plants"])
ORIGIN = ["image", "number", "split", "field", "camera", "day", "frame", "light"]
assert list(plants.columns[:12]) == [*ORIGIN, "plant", "id", "class", "species"]
assert list(leaves.columns[:11]) == [*ORIGIN, "plant", "leaf", "id"]
assert list(views.columns[:8]) == ORIGIN
for rows in (plants, leaves, views):
    # One image per field: no camera, no day, no frame, no light.
    assert (rows["field"] == rows["number"]).all() and rows[["camera", "day", "frame", "light"]].isna().all(axis=None)
    assert all(images[name].record["index"] == number for name, number in zip(rows["image"], rows["number"]))

table = pd.read_parquet(dataset / "traits" / "leaves.parquet")
same = {"image": "image", "number": "number", "split": "split", "field": "field", "plant": "plant", "leaf": "leaf", "id": "id", "pixels": "visible_px"}
traits = ("area_m2", "visible_area_m2", "length_m", "width_m", "petiole_m", "inclination_deg", "azimuth_deg", "top_m")
assert len(table) == len(leaves)
for ours, theirs in (same | {name: name for name in traits}).items():
    if len(leaves):
        assert (leaves[ours].to_numpy(table[theirs].dtype) == table[theirs].to_numpy()).all(), ours

for row in plants.itertuples():
    shown = images[row.image].plants == row.plant
    assert row.pixels == shown.sum()
    # Leaves outside the view have no rows, but count for the plant.
    own = leaves[(leaves["image"] == row.image) & (leaves["plant"] == row.plant)]
    assert own["area_m2"].sum() <= row.leaf_area_m2 * 1.001
    if len(own) == row.leaves:
        assert abs(own["area_m2"].sum() - row.leaf_area_m2) <= 1e-3 * row.leaf_area_m2
    assert 0 < row.cover_m2 <= np.pi * row.radius_m**2
    assert row.leaf_area_m2 > 0
    if len(own):
        assert own["top_m"].max() <= row.top_m + 1e-6

if len(leaves):
    # A blade has at most the area of its bounding rectangle, and more than zero.
    assert (leaves["area_m2"] <= 1.05 * leaves["length_m"] * leaves["width_m"]).all()
    assert (leaves["area_m2"] > 0).all()
    assert leaves["inclination_deg"].between(0, 90).all() and leaves["azimuth_deg"].between(0, 360).all()
    assert (leaves["visible_area_m2"] <= leaves["area_m2"]).all()

# Seen from above, the pixels of a completely visible plant cover approximately its projected area; each is a square
# whose side follows from its depth.
compared = 0
for name, image in images.items():
    view = views[views["image"] == name].iloc[0]
    assert view["crop_pixels"] + view["weed_pixels"] + view["soil_pixels"] == image.plants.size
    assert abs(view["lai"] - view["leaf_area_m2"] / view["ground_m2"]) < 1e-4
    camera = image.record["conditions"]["camera"]
    depth = OpenEXR.File(str(dataset / "images" / name / "geometry.exr")).channels()["depth.Z"].pixels
    each = depth.astype(float) ** 2 / (camera["fx_px"] * camera["fy_px"])
    for row in plants[plants["image"] == name].itertuples():
        if row.pixels > 150 and row.pixels == row.whole_pixels:
            covered = each[image.plants == row.plant].sum()
            assert 0.8 < row.cover_m2 / covered < 1.25, (name, row.plant, row.cover_m2 / covered)
            compared += 1
assert compared > 0 or not len(plants)
print(f"traits: {len(plants)} plants, {len(leaves)} leaves, {compared} areas compared with pixels")
