"""Checks that scenes as dicts render as their files. Arguments: a scene file, a dataset of two images of it, an empty folder."""

import copy
import json
import os
import pickle
import subprocess
import sys
import time
import warnings
from pathlib import Path

import furrow as fw
import numpy as np

file, dataset, folder = sys.argv[1:]
SIZE = {"width": 48, "spp": 1}


def equal(ours, other):
    """Compare the maps and the record of two images."""
    differing = [key for key in {**ours.record, **other.record} if ours.record.get(key) != other.record.get(key)]
    assert not differing, differing
    for name in ("image", "nir", "semantics", "plants", "leaves"):
        assert ours[name].dtype == other[name].dtype and np.array_equal(ours[name], other[name]), name


def fails(call, kind=fw.FurrowError):
    """Return the error of a call."""
    try:
        call()
    except kind as error:
        return error
    raise AssertionError(kind)


started = []
popen = subprocess.Popen


def remembered(*arguments, **named):
    """Start a program and store its arguments."""
    started.append(arguments[0])
    return popen(*arguments, **named)


subprocess.Popen = remembered

# Without a change, images are those of the dataset, with the same record; as a dict, too.
scene = fw.load(file)
assert list(scene)[:2] == ["seed", "camera"] and scene["camera"]["type"] == "Pinhole", scene
assert repr(scene) == "furrow.Scene(small.ron: Pinhole, crops 1, weeds 1, plants 1)", scene
data = fw.Dataset(dataset)
for index in (0, 1):
    image = scene.render(index=index, **SIZE)
    equal(image, data[index])
    equal(fw.render(file, index=index, **SIZE), data[index])
    equal(fw.Scene(copy.deepcopy(scene), scene.folder).render(index=index, **SIZE), data[index])
assert image.rgb is image["image"] and image.depth.dtype == np.float32 and 0.2 < image.depth.min() < image.depth.max() < 1
image.rgb[:] = 0  # The caller owns the memory.
assert [command[1] for command in started] == ["serve"], "a process was started for an image"

# Changes have an effect; NumPy's numbers and paths are values; other commands take the scene too.
before = copy.deepcopy(scene)
scene["camera"]["pose"]["height_m"] = np.float64(0.6)
scene["crops"][0]["species"] = "maize"
scene["camera"]["intrinsics"]["horizontal_deg"] = "Uniform(40, 41)"
del scene["plants"]
changed = scene.render(**SIZE)
assert {plant["grown"]["species"] for plant in changed.record["plants"] if plant["class"] == "crop"} <= {"maize"}
assert changed.depth.max() > image.depth.max() and changed.provenance["scene"] != image.provenance["scene"]
equal(next(scene.stream(count=1, **SIZE)), changed)
saved = scene.save(Path(folder) / "field.ron")
assert "maize" in saved.read_text() and fw.load(saved)["crops"][0]["species"] == "maize"
equal(fw.render(saved, **SIZE), changed)
equal(before.render(index=1, **SIZE), data[1])

# A species file that is written again is read again.
own = Path(folder) / "own.ron"
own.write_text('Species(name: "own", scientific: "", eppo: "OWNSP", role: Crop, like: "maize.ron")')
scene["crops"][0]["species"] = str(own)
for name in ("own", "other"):
    own.write_text(own.read_text().replace('"own"', f'"{name}"'))
    found = scene.render(**SIZE).record["conditions"]["crops"]
    assert [crop["species"] for crop in found] == [name], found

# Errors and warnings of the program.
scene["crops"][0]["spacies"] = 3
error = fails(lambda: scene.render(**SIZE))
assert (error.kind, error.place.column) == ("input", 13) and error.help.startswith("did you mean `species`"), error.help
assert "unknown field `spacies` in Crop" in str(error) and "^^^^^^^" in str(error), error
assert pickle.loads(pickle.dumps(error)).place == error.place
del scene["crops"][0]["spacies"]
assert fails(lambda: fw.load("fild")).help.startswith("did you mean field")
assert fails(lambda: fw.render(file, spp=0)).kind == "misuse"
error = fails(lambda: fw.render(file, index=2**64 - 1, **SIZE))
assert error.kind == "misuse" and "has no image number" in str(error), error
error = fails(lambda: list(fw.stream(file, count=1, crop_=1)), TypeError)
error = fails(lambda: scene.render(wdith=3), TypeError)
assert "'wdith'; did you mean 'width'?" in str(error), error
assert isinstance(fails(lambda: fw.Scene({"camera": {1, 2}}).render(), TypeError), TypeError)
scene["crops"][0]["rows"]["spacing_m"] = 3
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    scene.render(progress=True, **SIZE)
    list(scene.stream(count=1, **SIZE))
assert {(w.category, w.filename) for w in caught} == {(fw.FurrowWarning, __file__)}, caught
assert sum("stand 3 m apart" in str(w.message) for w in caught) == 2, [str(w.message) for w in caught]

# A child process has a program of its own, and the parent's still answers.
child = os.fork()
if child == 0:
    fine = fw.render(file, **SIZE).record == data[0].record
    os._exit(0 if fine else 1)
assert os.waitpid(child, 0)[1] == 0
equal(fw.render(file, **SIZE), data[0])
# A program that was killed is started again.
fw._program._worker.process.kill()
time.sleep(0.5)
equal(fw.render(file, **SIZE), data[0])



def resolved(value, folder):
    """Return the values of a scene with the full paths of the files that they name."""
    if isinstance(value, dict):
        return {key: resolved(inner, folder) for key, inner in value.items()}
    if isinstance(value, list):
        return [resolved(inner, folder) for inner in value]
    full = os.path.join(folder, value) if isinstance(value, str) else ""
    return os.path.realpath(full) if os.path.isfile(full) else value


# Every shipped scene file has the same values after a way through a dict.
shipped = sorted(Path("scenes").glob("*.ron"))
assert len(shipped) > 20, shipped
for page in shipped:
    there = fw.load(page)
    back = fw.load(fw.Scene(there, there.folder).save(Path(folder) / "back.ron"))
    assert resolved(back, "/") == resolved(there, there.folder), page

# The dict is what JSON can hold.
assert json.loads(json.dumps(before)) == before
