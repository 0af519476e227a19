"""Compares DATASET/skeletons with records and traits: parents come first, ends are the leaf's keypoints, lengths are its sizes."""

import json
import sys
from pathlib import Path

import numpy as np

import native

dataset = Path(sys.argv[1])
leaves = 0
for name, image in native.read(dataset).items():
    told = json.loads((dataset / "skeletons" / image.split / f"{name}.json").read_text())["plants"]
    plants = image.record["plants"]
    assert [p["plant"] for p in told] == [p["number"] for p in plants]
    camera = image.record["conditions"]["camera"]
    for skeleton, plant in zip(told, plants):
        assert skeleton["id"] == plant["id"]
        assert [l["leaf"] for l in skeleton["leaves"]] == [l["number"] for l in plant["leaves"]]
        for bones, leaf in zip(skeleton["leaves"], plant["leaves"]):
            joints = bones["joints"]
            names = [j["name"] for j in joints]
            assert len(set(names)) == len(names) and names[0] == "ST1"
            assert joints[0]["parent"] is None
            assert all(j["parent"] < k for k, j in enumerate(joints) if k > 0)
            at = {j["name"]: np.array(j["world_m"]) for j in joints}
            pixel = {j["name"]: j["pixel"] for j in joints}
            # Projection of the image's pinhole camera; the small scene has no lens distortion.
            for key, place in at.items():
                x, y, z = np.array(camera["world_to_camera"]) @ (place - camera["position_m"])
                u, v = camera["fx_px"] * x / z + camera["cx_px"], camera["fy_px"] * y / z + camera["cy_px"]
                assert np.abs(np.array(pixel[key]) - (u, v)).max() < 0.02
            for end, point in (("B", "base"), ("PK", "tip")):
                assert abs(pixel[end][0] - leaf[point]["x"]) < 1e-3 and abs(pixel[end][1] - leaf[point]["y"]) < 1e-3
            # Bending preserves the lengths of petiole and blade.
            chain = [n for n in names if not n.startswith(("STL", "STR"))]
            assert [joints[names.index(n)]["parent"] for n in chain[1:]] == list(range(len(chain) - 1))
            links = {b: np.linalg.norm(at[b] - at[a]) for a, b in zip(chain, chain[1:])}
            blade = sum(length for n, length in links.items() if n.startswith(("VN", "PK")))
            petiole = sum(length for n, length in links.items() if n.startswith(("ST", "B")))
            assert abs(blade - leaf["traits"]["length_m"]) < 1e-5 + 1e-3 * blade
            assert abs(petiole - leaf["traits"]["petiole_m"]) < 1e-5 + 1e-3 * petiole
            leaves += 1
print(f"skeletons: {leaves} leaves")
