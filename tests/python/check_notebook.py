"""Runs code cells of docs/guide/notebook.ipynb in order, with small images, and checks what they made. Arguments: the notebook, and what
to run: `plots`, all cells without PyTorch, or `torch`, all cells without Matplotlib."""

import json
import sys
import types

part = sys.argv[2]
if part == "plots":
    import matplotlib

    matplotlib.use("Agg")
else:
    sys.modules["matplotlib"] = types.ModuleType("matplotlib")
    sys.modules["matplotlib.pyplot"] = sys.modules["matplotlib"].pyplot = types.ModuleType("matplotlib.pyplot")

notebook = json.loads(open(sys.argv[1], encoding="utf-8").read())
assert notebook["nbformat"] == 4 and len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])
code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
assert all(not cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"), "clear the outputs"
small = {"width": 64, "spp": 1}
SIZE = 'SIZE = {"width": 324, "spp": 16}'
assert code[0].count(SIZE) == 1
code[0] = code[0].replace(SIZE, f"SIZE = {small}")
names = {"__name__": "__main__"}
training = next(number for number, text in enumerate(code) if "import torch" in text)
for number, text in enumerate(code):
    if number >= training if part == "plots" else "plt." in text:
        continue
    exec(compile(text, f"code cell {number}", "exec"), names)
assert len(names["data"]) == 2
if part == "plots":
    assert names["image"].rgb.shape[1] == small["width"] and "_repr_html_" in dir(names["image"])
    # The crop grows, and the images differ.
    assert names["cover"][0] < names["cover"][-1], names["cover"]
    assert names["over"].shape == names["item"].rgb.shape
    assert (names["over"] != names["item"].rgb).any()
    print("notebook:", training, "cells, cover", [round(float(share), 4) for share in names["cover"]])
else:
    # Most pixels are soil, so a network that learns nothing has a loss near that of a constant answer.
    losses = names["losses"]
    assert losses[-1] < 0.5 * losses[0], losses
    assert names["found"].shape == names["plants"].shape and 0 <= names["iou"] <= 1
    print("notebook: loss", losses[0], losses[-1], "IoU", names["iou"])
