"""Compares the tables of images, plants and leaves with the records: days, cameras, samples and the condition of plants.

check_index.py DATASET
"""

import json
import sys
from pathlib import Path

import pandas

root = Path(sys.argv[1])
records = [json.loads(path.read_text()) for path in sorted(root.glob("images/*/record.json"))]
images, table = pandas.read_parquet(root / "images.parquet"), pandas.read_parquet(root / "plants.parquet")
asked = json.loads((root / "dataset.json").read_text())["made"]["rendered"]["spp"]
for record, row in zip(records, images.to_dict("records"), strict=True):
    capture, sampling = record["capture"], record.get("sampling")
    assert (row["day"], row["frame"], row["camera"]) == (capture["day"], capture["frame"], capture["camera"])
    assert row["spp"] == (sampling["spp"] if sampling else asked), row["spp"]
plants = [plant for record in records for plant in record["plants"]]
# Each row names its image as the table of images does, also in CSV.
ORIGIN = ["image", "number", "split", "field", "camera", "day", "frame"]
told = {row["image"]: row for row in images[ORIGIN].to_dict("records")}
read = lambda name: pandas.read_csv(root / "traits" / name, dtype={"image": str})
leaves = pandas.read_parquet(root / "traits/leaves.parquet")
for rows in (table, leaves, read("plants.csv"), read("leaves.csv"), read("images.csv")):
    # One light, so the column of lights is empty.
    assert list(rows.columns[: len(ORIGIN) + 1]) == [*ORIGIN, "light"] and rows["light"].isna().all(), list(rows.columns)
    assert len(rows) > 0 and all(row == told[row["image"]] for row in rows[ORIGIN].to_dict("records"))
assert list(read("images.csv")["image"]) == list(images["image"])
NAMES = "holes shot_holes bites tears chlorosis blotches spots scorched scorch reddening dust splash wilt pale_young"
marked = 0
for plant, row in zip(plants, table.to_dict("records"), strict=True):
    condition = plant["grown"].get("condition")
    for name in NAMES.split():
        assert pandas.isna(row[name]) if condition is None else abs(row[name] - condition[name]) < 1e-6, name
    marked += condition is not None and row["wilt"] > 0
assert set(images["day"]) == {9, 21} and marked > 0, (set(images["day"]), marked)
# Growth curves, computed from the table alone as in the guide.
curves = table[table["camera"] == images["camera"][0]].pivot_table("leaf_area_m2", "day", "id")
expected = {}
for record in records:
    for plant in record["plants"]:
        if record["capture"]["camera"] == images["camera"][0]:
            areas = expected.setdefault((record["capture"]["day"], plant["id"]), [])
            areas.append(plant["grown"]["traits"]["leaf_area_m2"])
assert expected and curves.count().max() == 2, "some plant must be visible on both days"
for (day, plant), areas in expected.items():
    assert abs(curves.loc[day, plant] - sum(areas) / len(areas)) < 1e-7
print(f"{len(images)} images, {len(plants)} plants, {marked} of them wilted")
