"""Reads DATASET/kitti as KITTI's development kit does: boxes contain the plants' visible surface points and joints, are tight, and their projections contain the plants' masks."""

import json
import sys
from pathlib import Path

import numpy as np
from plyfile import PlyData

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
root = dataset / "kitti/training"
# Meshes and labels are in single precision.
NEAR = 2e-5


def calibration(path):
    lines = (line.split(":") for line in path.read_text().splitlines())
    return {name: np.array(values.split(), float) for name, values in lines}


def corners(row):
    """The corners of a label's box in the camera's frame, as in KITTI's computeBox3D.m."""
    height, width, length = row[:3]
    x = np.array([1, 1, -1, -1, 1, 1, -1, -1]) * length / 2
    y = np.array([0, 0, 0, 0, -1, -1, -1, -1]) * height
    z = np.array([1, -1, -1, 1, 1, -1, -1, 1]) * width / 2
    c, s = np.cos(row[6]), np.sin(row[6])
    return np.stack([c * x + s * z, y, -s * x + c * z], 1) + row[3:6]


def holds(around, points):
    """Whether an oriented box with `centre_m`, `size_m` and `axes` contains all points."""
    local = (points - around["centre_m"]) @ np.array(around["axes"]).T
    return (np.abs(local) <= np.array(around["size_m"]) / 2 + NEAR).all()


def hull(points):
    """Convex hull, counter-clockwise in image coordinates."""
    points = sorted(map(tuple, points))
    halves = []
    for side in (points, points[::-1]):
        half = []
        for p in side:
            while len(half) > 1 and np.linalg.det([np.subtract(half[-1], half[-2]), np.subtract(p, half[-2])]) <= 0:
                half.pop()
            half.append(p)
        halves += half[:-1]
    return np.array(halves)


def inside(outline, points, margin):
    """Whether all points are inside a convex outline, up to a distance."""
    edges = np.roll(outline, -1, 0) - outline
    normals = np.stack([edges[:, 1], -edges[:, 0]], 1) / np.linalg.norm(edges, axis=1)[:, None]
    return all(((points - a) @ n).max() <= margin for a, n in zip(outline, normals))


plants = 0
for name, image in images.items():
    assert np.array_equal(native.picture(root / "image_2" / f"{name}.png"), image.rgb)
    calib = calibration(root / "calib" / f"{name}.txt")
    P2, to_camera = calib["P2"].reshape(3, 4), calib["Tr_velo_to_cam"].reshape(3, 4)
    rows = [line.split() for line in (root / "label_2" / f"{name}.txt").read_text().splitlines()]
    assert all(len(row) == 15 for row in rows)
    listed = json.loads((root / "boxes" / f"{name}.json").read_text())["plants"]
    seen = image.seen()
    assert [b["plant"] for b in listed] == [p["number"] for p in seen]
    if not seen:
        assert [row[0] for row in rows] == ["DontCare"]
        continue
    points = PlyData.read(str(dataset / "ply" / image.split / f"{name}.ply"))["vertex"]
    of = np.array(points["plant"])
    world = np.stack([points[k] for k in "xyz"], 1).astype(float)
    in_camera = world @ to_camera[:, :3].T + to_camera[:, 3]
    joints = json.loads((dataset / "skeletons" / image.split / f"{name}.json").read_text())["plants"]
    # Joints of petiole and midrib are on the mesh; those of secondary veins may be beside a narrow blade.
    joints = {
        s["plant"]: [j["world_m"] for l in s["leaves"] for j in l["joints"] if not j["name"].startswith(("STL", "STR"))]
        for s in joints
    }
    amodal = json.loads((dataset / "amodal/plants" / image.split / f"{name}.json").read_text())
    amodal = {a["attributes"]["plant"]: a["bbox"] for a in amodal}
    for row, box, plant in zip(rows, listed, seen):
        number = plant["number"]
        truncated, occluded, alpha, left, top, right, bottom = map(float, row[1:8])
        of_box = np.array(row[8:], float)
        assert row[0] == plant["class"] == box["class"] and box["id"] == plant["id"]
        assert abs(truncated - (1 - native.inside(plant["seen"]))) < 1e-4
        assert occluded == (0 if plant["seen"]["pixels"] == plant["seen"]["unoccluded"] else 1 if 2 * plant["seen"]["pixels"] >= plant["seen"]["unoccluded"] else 2)
        x, y, w, h = amodal[number]
        assert [left, top, right, bottom] == [x, y, x + w - 1, y + h - 1]
        around = corners(of_box)
        assert np.abs(np.sort(around, 0) - np.sort(box["camera"]["corners_m"], 0)).max() < 2e-6
        expected = of_box[6] - np.arctan2(of_box[3], of_box[5])
        assert abs((alpha - expected + np.pi) % (2 * np.pi) - np.pi) < 1e-5
        # The points in both frames, and the joints.
        mine = world[of == number]
        assert len(mine) == plant["seen"]["pixels"]
        assert holds(box["world"], mine) and holds(box["camera"], in_camera[of == number])
        if joints[number]:
            assert holds(box["world"], np.array(joints[number]))
        # No larger than the cylinder around the plant that the record states, which has its own reference point.
        length, width, height = box["world"]["size_m"]
        assert length >= width > 0 and length <= 2 * plant["grown"]["radius_m"] + NEAR
        assert height <= 1.5 * plant["grown"]["height_m"] + 0.02
        # Projections: corner by corner through P2, whose first pixel's centre is (0, 0).
        for frame, moved in (("camera", np.eye(3, 4)), ("world", to_camera)):
            at = np.array(box[frame]["corners_m"]) @ moved[:, :3].T + moved[:, 3]
            assert (at[:, 2] > 0).all()
            pixels = at @ P2[:, :3].T + P2[:, 3]
            ys, xs = np.where(image.plant_mask(plant))
            assert inside(hull(pixels[:, :2] / pixels[:, 2:]), np.stack([xs, ys], 1), 0.02)
        plants += 1

for split in native.SPLITS:
    path = dataset / f"kitti/ImageSets/{split}.txt"
    own = [image.name for image in native.of_split(images, split)]
    assert (path.read_text().split() if path.exists() else []) == own
print(f"kitti: {plants} plants")
