"""Runs the code cells of docs/guide/notebook.ipynb in order, with small images, and checks what they made. Argument: the notebook."""

import json
import sys

import matplotlib

matplotlib.use("Agg")

notebook = json.loads(open(sys.argv[1], encoding="utf-8").read())
assert notebook["nbformat"] == 4 and len({cell["id"] for cell in notebook["cells"]}) == len(notebook["cells"])
code = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
assert all(not cell["outputs"] for cell in notebook["cells"] if cell["cell_type"] == "code"), "clear the outputs"
small = {"width": 64, "spp": 1}
SIZE = 'SIZE = {"width": 324, "spp": 16}'
assert code[0].count(SIZE) == 1
code[0] = code[0].replace(SIZE, f"SIZE = {small}")
names = {"__name__": "__main__"}
for number, text in enumerate(code):
    exec(compile(text, f"code cell {number}", "exec"), names)
assert names["image"].rgb.shape[1] == small["width"] and "_repr_html_" in dir(names["image"])
# The crop grows, and the images differ.
assert names["cover"][0] < names["cover"][-1], names["cover"]
assert len(names["data"]) == 2 and names["over"].shape == names["item"].rgb.shape
assert (names["over"] != names["item"].rgb).any()
print("notebook:", len(code), "cells, cover", [round(float(share), 4) for share in names["cover"]])
