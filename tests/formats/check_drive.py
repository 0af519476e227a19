"""Checks a drive with a stereo pair using COLMAP's own reader and OpenCV's stereo matcher: check_drive.py DATASET"""
import json
import pathlib
import sys

import cv2
import numpy
import OpenEXR
import pycolmap

dataset = pathlib.Path(sys.argv[1])


def record(name):
    return json.loads((dataset / "images" / name / "record.json").read_text())


# COLMAP: reads the model; its cameras must project the plants' stems to the positions in the records.
model = pycolmap.Reconstruction(str(dataset / "colmap/000000"))
assert len(model.images) == 4 and len(model.cameras) == 2, model.summary()
points = 0
for image in model.images.values():
    assert (dataset / "images" / image.name).is_file(), image.name
    for plant in record(image.name.split("/")[0])["plants"]:
        if plant["stem"]["state"] == "outside":
            continue
        seen = image.project_point(numpy.array(plant["grown"]["position_m"]))
        told = numpy.array([plant["stem"]["x"], plant["stem"]["y"]])
        assert seen is not None and numpy.abs(seen - told).max() < 0.01, (image.name, seen, told)
        points += 1
assert points >= 4, points

# transforms.json: the same points, projected with its matrices and intrinsics in OpenGL's axes.
for frame in json.loads((dataset / "nerf/000000/transforms.json").read_text())["frames"]:
    path = (dataset / "nerf/000000" / frame["file_path"]).resolve()
    assert path.is_file(), path
    to_camera = numpy.linalg.inv(numpy.array(frame["transform_matrix"]))
    for plant in record(path.parent.name)["plants"]:
        x, y, z, _ = to_camera @ numpy.array([*plant["grown"]["position_m"], 1.0])
        if plant["stem"]["state"] != "outside":
            seen = [frame["fl_x"] * x / -z + frame["cx"], frame["fl_y"] * -y / -z + frame["cy"]]
            told = [plant["stem"]["x"], plant["stem"]["y"]]
            assert numpy.abs(numpy.subtract(seen, told)).max() < 0.01, (seen, told)

# MOTS: a plant has the same number in all images; every mask has the area in the record.
tracks = {}
for camera in ("camera", "right"):
    for line in (dataset / f"mots/000000-{camera}.txt").read_text().splitlines():
        frame, track, kind, height, width, mask = line.split(" ")
        assert (int(height), int(width)) == (240, 320) and kind in "12" and mask
        tracks.setdefault(track, set()).add((camera, frame))
assert max(len(seen) for seen in tracks.values()) == 4, tracks

# OpenCV: its matcher does not know our geometry.
left, right = (cv2.imread(str(dataset / f"images/{name}/rgb.png"), cv2.IMREAD_GRAYSCALE) for name in ("000000", "000001"))
matcher = cv2.StereoSGBM_create(minDisparity=0, numDisparities=64, blockSize=7, P1=8 * 49, P2=32 * 49, uniquenessRatio=10)
found = matcher.compute(left, right).astype(numpy.float32) / 16
channels = OpenEXR.File(str(dataset / "flow/000000.exr")).channels()
told, visible = -channels["right.x"].pixels, channels["right.visible"].pixels > 0
assert numpy.nanmax(numpy.abs(channels["right.y"].pixels)) < 0.01, "the pair is not rectified"
deviation = cv2.blur(left.astype(numpy.float32) ** 2, (7, 7)) - cv2.blur(left.astype(numpy.float32), (7, 7)) ** 2
asked = (found > 0) & visible & (deviation > 20) & numpy.isfinite(told)
error = numpy.abs(found - told)[asked]
assert asked.sum() > 5000, asked.sum()
assert numpy.median(error) < 1 and (error < 1).mean() > 0.8, (numpy.median(error), (error < 1).mean())
print(f"{points} stems projected alike; disparity: median error {numpy.median(error):.2f} px, {100 * (error < 1).mean():.0f} % of {asked.sum()} within a pixel")
