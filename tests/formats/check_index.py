"""Do `images.parquet` and `plants.parquet` hold what the records do, of days, samples and the condition of plants?

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
NAMES = "holes shot_holes bites tears chlorosis blotches spots scorched scorch reddening dust splash wilt pale_young"
marked = 0
for plant, row in zip(plants, table.to_dict("records"), strict=True):
    condition = plant["grown"].get("condition")
    for name in NAMES.split():
        assert pandas.isna(row[name]) if condition is None else abs(row[name] - condition[name]) < 1e-6, name
    marked += condition is not None and row["wilt"] > 0
assert set(images["day"]) == {9, 21} and marked > 0, (set(images["day"]), marked)
print(f"{len(images)} images, {len(plants)} plants, {marked} of them wilted")
