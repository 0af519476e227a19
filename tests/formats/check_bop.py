"""Reads DATASET/bop as BOP's toolkit does: masks and counts are those of the native files, poses place the boxes on the plants' surface points, and depth is in millimetres."""

import json
import sys
from pathlib import Path

import numpy as np
from plyfile import PlyData

import native

dataset = Path(sys.argv[1])
images = native.read(dataset)
models = json.loads((dataset / "bop/models/models_info.json").read_text())
plants, cut, objects = 0, 0, set()
for split, folder in zip(native.SPLITS, ("train_pbr", "val", "test")):
    own = native.of_split(images, split)
    root = dataset / "bop" / folder / "000000"
    assert root.exists() == bool(own)
    if not own:
        continue
    cameras, poses, infos = (json.loads((root / f"{name}.json").read_text()) for name in ("scene_camera", "scene_gt", "scene_gt_info"))
    assert set(cameras) == set(poses) == set(infos) == {str(image.record["index"]) for image in own}
    for image in own:
        key = str(image.record["index"])
        assert np.array_equal(native.picture(root / "rgb" / f"{image.name}.png"), image.rgb)
        camera, K = cameras[key], np.array(cameras[key]["cam_K"]).reshape(3, 3)
        R, t = np.array(camera["cam_R_w2c"]).reshape(3, 3), np.array(camera["cam_t_w2c"])
        points = PlyData.read(str(dataset / "ply" / image.split / f"{image.name}.ply"))["vertex"]
        of = np.array(points["plant"])
        at = np.stack([points[k] for k in "xyz"], 1) * 1000.0 @ R.T + t
        # Each surface point is at its pixel, at the depth of the map.
        u, v = (at @ K.T)[:, :2].T / at[:, 2]
        columns, rows = np.round(u).astype(int), np.round(v).astype(int)
        assert max(np.abs(u - columns).max(), np.abs(v - rows).max()) < 0.02
        depth = native.picture(root / "depth" / f"{image.name}.png") * camera["depth_scale"]
        assert np.abs(depth[rows, columns] - at[:, 2]).max() <= camera["depth_scale"]
        seen = image.seen()
        assert [pose["plant"] for pose in poses[key]] == [p["number"] for p in seen]
        for number, (pose, info, plant) in enumerate(zip(poses[key], infos[key], seen)):
            masks = [native.picture(root / kind / f"{image.name}_{number:06}.png") for kind in ("mask", "mask_visib")]
            assert all(set(np.unique(mask)) <= {0, 255} for mask in masks)
            whole, visible = (mask > 0 for mask in masks)
            assert np.array_equal(visible, image.plant_mask(plant)) and not (visible & ~whole).any()
            counts = [info[f"px_count_{kind}"] for kind in ("visib", "valid", "all")]
            assert counts == [plant["seen"][kind] for kind in ("pixels", "unoccluded", "whole")]
            assert counts[:2] == [visible.sum(), whole.sum()] and abs(info["visib_fract"] - counts[0] / counts[2]) < 1e-9
            assert info["bbox_visib"] == plant["seen"]["box"]
            # The box is that of the whole silhouette: it leaves the frame if and only if pixels of the plant do.
            left, top, width, height = info["bbox_obj"]
            low, end = np.maximum((left, top), 0), np.minimum((left + width, top + height), whole.shape[::-1])
            held = np.zeros_like(whole)
            held[low[1]:end[1], low[0]:end[0]] = True
            assert not (whole & ~held).any()
            leaves = left < 0 or top < 0 or left + width > whole.shape[1] or top + height > whole.shape[0]
            assert leaves == (counts[2] > counts[1])
            if not leaves:
                rows, columns = np.nonzero(whole)
                assert [left, top] == [columns.min(), rows.min()]
                assert [left + width, top + height] == [columns.max() + 1, rows.max() + 1]
            cut += leaves
            turn, shift = np.array(pose["cam_R_m2c"]).reshape(3, 3), np.array(pose["cam_t_m2c"])
            assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-6) and np.linalg.det(turn) > 0
            model = models[str(pose["obj_id"])]
            local = (at[of == plant["number"]] - shift) @ turn
            low = np.array([model[f"min_{k}"] for k in "xyz"])
            size = np.array([model[f"size_{k}"] for k in "xyz"])
            assert (local >= low - 0.02).all() and (local <= low + size + 0.02).all()
            assert abs(model["diameter"] - np.linalg.norm(size)) < 1e-6
            assert pose["class"] == plant["class"] and pose["species"] == plant["grown"]["species"]
            objects.add(pose["obj_id"])
            plants += 1
assert objects == set(range(1, len(models) + 1))
assert cut or not plants, "no plant leaves the frame"
print(f"bop: {plants} plants, {len(objects)} objects")
