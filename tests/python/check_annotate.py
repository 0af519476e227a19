"""Writes predictions for CVAT and Label Studio and reads them back: with datumaro, which is CVAT's own reader, and with the decoder of rle-pack, which Label Studio uses. Argument: an empty folder."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
from datumaro import Dataset
from PIL import Image

folder = Path(sys.argv[1])
random = np.random.default_rng(7)
NAMES, COLORS = ["soil", "crop", "weed"], [[128, 102, 77], [51, 179, 51], [217, 51, 51]]
# Small patches, a long run, and an image without weed.
MAPS = {
    "a": np.kron(random.integers(0, 3, (6, 9)), np.ones((5, 4))).astype(np.uint8),
    "b": random.integers(0, 3, (31, 23)).astype(np.uint8),
    "c": np.where(np.arange(300 * 400).reshape(300, 400) < 70000, 1, 0).astype(np.uint8),
}
for name, classes in MAPS.items():
    picture = Image.fromarray(classes)
    picture.putpalette(sum(COLORS, []))
    picture.save(folder / f"{name}.png")
about = {"network": "lite-unet", "weights_sha256": "0" * 64, "classes": list(zip(NAMES, COLORS)), "pictures": {n: f"photos/{n}.jpg" for n in MAPS}}
(folder / "prediction.json").write_text(json.dumps(about))


def run(*arguments):
    return subprocess.run([sys.executable, "-m", "furrow.annotate", *map(str, arguments)], capture_output=True, text=True)


made = run(folder, "--cvat", folder / "masks.zip", "--label-studio", folder / "tasks.json", "--prefix", "http://host/")
assert made.returncode == 0, made.stderr
assert '<Label value="weed" background="#d93333"/>' in made.stdout and "soil" not in made.stdout

with zipfile.ZipFile(folder / "masks.zip") as archive:
    archive.extractall(folder / "cvat")
data = Dataset.import_from(str(folder / "cvat"), "voc_segmentation")
labels = [label.name for label in data.categories()[next(iter(data.categories()))]]
assert labels == ["background", "crop", "weed"], labels
assert sorted(item.id for item in data) == sorted(MAPS)
for item in data:
    found = np.zeros_like(MAPS[item.id])
    for annotation in item.annotations:
        found[np.asarray(annotation.image).astype(bool)] = annotation.label
    assert np.array_equal(found, MAPS[item.id]), item.id


def decode(packed):
    """The decoder of rle-pack: header, then runs and single values."""
    bits, at = "".join(f"{byte:08b}" for byte in packed), 0

    def read(size):
        nonlocal at
        at += size
        return int(bits[at - size : at], 2)

    count, word, sizes = read(32), read(5) + 1, [read(4) + 1 for _ in range(4)]
    out = np.zeros(count, np.uint8)
    i = 0
    while i < count:
        run, j = read(1), i + 1 + read(sizes[read(2)])
        if run:
            out[i:j] = read(word)
        else:
            out[i:j] = [read(word) for _ in range(i, j)]
        i = j
    return out


tasks = json.loads((folder / "tasks.json").read_text())
assert [task["data"]["image"] for task in tasks] == [f"http://host/{name}.jpg" for name in MAPS]
for task, classes in zip(tasks, MAPS.values()):
    results = task["predictions"][0]["result"]
    assert [r["value"]["brushlabels"][0] for r in results] == [NAMES[k] for k in (1, 2) if (classes == k).any()]
    for result in results:
        assert (result["original_height"], result["original_width"]) == classes.shape
        channels = decode(result["value"]["rle"]).reshape(*classes.shape, 4)
        expected = (classes == NAMES.index(result["value"]["brushlabels"][0])) * 255
        assert np.array_equal(channels, np.repeat(expected[..., None], 4, 2))

(folder / "empty").mkdir()
lost = run(folder / "empty", "--cvat", folder / "x.zip")
assert lost.returncode == 2 and lost.stderr.startswith("error: ") and " help: write them: train predict" in lost.stderr

# Damaged input and outputs that cannot be written: one error, exit code 2, no file.
whole, mask = (folder / "prediction.json").read_bytes(), (folder / "a.png").read_bytes()
wrong = {**about, "classes": [["soil", [1]], ["crop", "x"]]}
twice = {**about, "pictures": {n: f"photos/{n}/rgb.png" for n in MAPS}}
for out, file, content in [
    (folder / "x.zip", "prediction.json", whole[: len(whole) // 2]),
    (folder / "x.zip", "prediction.json", b"[]"),
    (folder / "x.zip", "prediction.json", json.dumps(wrong).encode()),
    (folder / "x.zip", "prediction.json", json.dumps(twice).encode()),
    (folder / "x.zip", "a.png", mask[: len(mask) // 2]),
    (folder / "x.zip", "a.png", b"no picture"),
    ("/proc/x/x.zip", "a.png", mask),
    (folder / "empty", "a.png", mask),
]:
    before = (folder / file).read_bytes()
    (folder / file).write_bytes(content)
    refused = run(folder, "--cvat", out)
    (folder / file).write_bytes(before)
    assert refused.returncode == 2 and refused.stderr.startswith("error: "), (file, content[:40], refused.stderr)
    assert "Traceback" not in refused.stderr and not list(folder.glob(".furrow-*")), refused.stderr
    assert not (folder / "x.zip").exists()
print("annotate:", len(tasks), "images")
