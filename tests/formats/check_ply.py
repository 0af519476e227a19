"""Reads DATASET/ply with plyfile: the camera sees every point at the pixel it was made from, and colour and labels are those of that pixel."""

import sys
from pathlib import Path

import numpy as np
import plyfile

import native

dataset = Path(sys.argv[1])
for name, image in native.read(dataset).items():
    points = plyfile.PlyData.read(dataset / "ply" / image.split / f"{name}.ply")["vertex"]
    camera = image.record["conditions"]["camera"]
    place = np.stack([points[axis] for axis in "xyz"], 1).astype(float) - camera["position_m"]
    right, down, depth = (place @ np.array(camera["world_to_camera"]).T).T
    assert (depth > 0).all()
    # The small scene has no lens distortion and no rolling shutter.
    assert not any(camera.get("distortion", {"k1": 0}).values())
    column = camera["fx_px"] * right / depth + camera["cx_px"]
    row = camera["fy_px"] * down / depth + camera["cy_px"]
    x, y = np.floor(column).astype(int), np.floor(row).astype(int)
    assert np.abs(column - (x + 0.5)).max() < 0.02 and np.abs(row - (y + 0.5)).max() < 0.02
    height, width = image.plants.shape
    assert ((0 <= x) & (x < width) & (0 <= y) & (y < height)).all()
    assert len(np.unique(y * width + x)) == len(points) == height * width
    assert (np.stack([points["red"], points["green"], points["blue"]], 1) == image.rgb[y, x]).all()
    assert (points["class"] == image.semantics[y, x]).all()
    assert (points["plant"] == image.plants[y, x]).all() and (points["leaf"] == image.leaves[y, x]).all()
    normals = np.stack([points[axis] for axis in ("nx", "ny", "nz")], 1)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1).max() < 1e-4
    # The normal faces the camera.
    assert ((normals * -place).sum(1) > 0).all()
    assert ((points["part"] > 10) == (points["plant"] > 0)).all()
print("ply: points project to their pixels")
