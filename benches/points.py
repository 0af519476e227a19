#!/usr/bin/env python3
"""Measures what points on a few plants gain (`train predict --like`).

    python benches/points.py --network any-field --points 10 --images 3 --seed 1 photos/maize photos/beets

A set is a folder with the subfolders `images` and `labels` (PNG of class indices with the stems of the images: 0 soil, 1
crop, 2 weed, others ignored). In `--images` of them, at even intervals, up to `--points` crop plants and as many weeds
are drawn: connected regions of the labels, each with a probability by the square root of its area. The network predicts
all images, without and with these points. The table holds the IoU of crop, vegetation and weed and the mean IoU over
soil, crop and weed, in % of the images without points.
"""

import argparse
import csv
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

SMALLEST = 40


def plants(labels, kind):
    """Returns a pixel inside each plant of a class, and its area."""
    regions, count = ndimage.label(labels == kind)
    areas = np.bincount(regions.ravel(), minlength=count + 1)[1:]
    found = []
    for number, box in enumerate(ndimage.find_objects(regions), 1):
        if areas[number - 1] >= SMALLEST:
            inside = ndimage.distance_transform_edt(np.pad(regions[box] == number, 1))[1:-1, 1:-1]
            y, x = np.unravel_index(inside.argmax(), inside.shape)
            found.append((x + box[1].start + 0.5, y + box[0].start + 0.5, areas[number - 1]))
    return found


def draw(pairs, count, random):
    """Draws points on crop plants and weeds of some images; returns rows of the table."""
    rows = []
    for kind, name in (1, "crop"), (2, "weed"):
        all_plants = [(image.name, *plant) for image, labels in pairs for plant in plants(np.asarray(Image.open(labels)), kind)]
        if all_plants:
            weights = np.sqrt([plant[3] for plant in all_plants])
            some = random.choice(len(all_plants), min(count, len(all_plants)), replace=False, p=weights / weights.sum())
            rows += [(*all_plants[k][:3], name) for k in some]
    return rows


def predict(train, network, images, out, extra):
    """Predicts the images of a folder."""
    subprocess.run([train, "predict", network, str(images), "--out", str(out), "--quiet", *extra], check=True, stdout=subprocess.DEVNULL)


def scores(pairs, out):
    """Returns the IoU of crop, vegetation and weed and the mean IoU of predictions, in %."""
    confusion = np.zeros((3, 3))
    for image, labels in pairs:
        true, found = np.asarray(Image.open(labels)), np.asarray(Image.open(out / f"{image.stem}.png"))
        known = true < 3
        confusion += np.bincount(true[known] * 3 + found[known], minlength=9).reshape(3, 3)
    iou = [confusion[k, k] / max(1, confusion[k].sum() + confusion[:, k].sum() - confusion[k, k]) for k in range(3)]
    both = confusion[1:, 1:].sum()
    vegetation = both / max(1, confusion.sum() - confusion[0, 0])
    return 100 * np.array([iou[1], vegetation, iou[2], np.mean(iou)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=Path)
    parser.add_argument("--train", default="target/release/train")
    parser.add_argument("--network", default="any-field")
    parser.add_argument("--points", type=int, nargs="+", default=[10], help="crop plants, and as many weeds")
    parser.add_argument("--images", type=int, default=3, help="images with points")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--every", type=int, default=1, help="use every N-th image")
    parser.add_argument("--first", type=int, default=0, help="the first of them")
    args = parser.parse_args()
    for folder in args.sets:
        pairs = [(p, folder / "labels" / f"{p.stem}.png") for p in sorted((folder / "images").iterdir())]
        pairs = [pair for pair in pairs if pair[1].exists()][args.first :: args.every]
        marked = pairs[:: max(1, len(pairs) // args.images)][: args.images]
        others = [pair for pair in pairs if pair not in marked]
        with tempfile.TemporaryDirectory() as work:
            work = Path(work)
            (work / "images").mkdir()
            for image, _ in pairs:
                (work / "images" / image.name).symlink_to(image.resolve())
            predict(args.train, args.network, work / "images", work / "without", [])
            print(folder.name, len(others), "images", "without", *scores(others, work / "without").round(1), flush=True)
            for count in args.points:
                rows = draw(marked, count, np.random.default_rng(args.seed))
                table = work / f"{count}.csv"
                with open(table, "w", newline="") as file:
                    csv.writer(file).writerows([("image", "x", "y", "class"), *rows])
                predict(args.train, args.network, work / "images", work / f"{count}", ["--like", str(table)])
                print(folder.name, len(others), "images", count, *scores(others, work / f"{count}").round(1), flush=True)


if __name__ == "__main__":
    main()
