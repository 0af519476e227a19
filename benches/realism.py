#!/usr/bin/env python3
"""Measures how well a classifier distinguishes rendered patches from photographs: its AUC, 0.5 where it cannot.

    target/venv-torch/bin/python benches/realism.py --real photos/peanut photos/wheat … --rendered renders/fields …

A set is a folder with the subfolders `images` and `labels` (PNG of class indices with the stems of the images), or the
folder of renders or of a dataset of `trace`. Squares of `--side` pixels that hold what `--of` names (`soil`: all but
5 % of class `--soil`; `plants`: at least 30 % of other classes) are read from all images, at most `--patches` an image
in a fixed random order. Each square is reduced to half its side and stored once as JPEG, quality 90, so that neither
sensor noise nor the compression of photographs decides.

Features: the 1,280 averages before the classes of EfficientNet-Lite0 (Tan & Le 2019), trained on ImageNet, frozen.
Classifier: logistic regression with an L2 penalty, classes weighted equally, sets of photographs weighted equally. Two
tests for each set of photographs, and no image is in training and test of either:

    unseen: trained on the other sets and every second rendered image, tested on all of this set and the other renders
    seen: trained on every second image of all sets and of the renders, tested on the other images of this set

The first asks what photographs share that renders lack. The second also counts what is particular to one camera and one
field, and is the harder. Needs PyTorch, `efficientnet-lite-pytorch`, safetensors (`bash tests/peers.sh`) and the weights
(`sh .libtorch/imagenet.sh`).
"""

import argparse
import io
import random
from pathlib import Path

import numpy as np
import torch
from efficientnet_lite_pytorch import EfficientNet
from PIL import Image
from ground import pairs
from safetensors.torch import load_file

WEIGHTS = Path(__file__).resolve().parent.parent / ".libtorch/efficientnet-lite0.safetensors"
PURE, PLANTED = 0.95, 0.30
PENALTY = 1e-2


def squares(image, mask, options, order):
    """Returns squares of one image, reduced and compressed."""
    picture = Image.open(image).convert("RGB")
    soil = np.asarray(Image.open(mask)) == options.soil
    if soil.shape != picture.size[::-1]:
        raise SystemExit(f"{mask}: {soil.shape[1]} × {soil.shape[0]} pixels instead of {picture.width} × {picture.height}")
    side = options.side
    corners = [(x, y) for y in range(0, soil.shape[0] - side + 1, side) for x in range(0, soil.shape[1] - side + 1, side)]
    order.shuffle(corners)
    taken = []
    for x, y in corners:
        share = soil[y : y + side, x : x + side].mean()
        if share >= PURE if options.of == "soil" else 1 - share >= PLANTED:
            small = picture.crop((x, y, x + side, y + side)).resize((side // 2, side // 2), Image.Resampling.BOX)
            stored = io.BytesIO()
            small.save(stored, "JPEG", quality=90)
            taken.append(np.asarray(Image.open(stored)))
        if len(taken) == options.patches:
            break
    return taken


def features(network, patches):
    """Returns the averaged features of patches: patch, 1280."""
    found = []
    with torch.no_grad():
        for batch in torch.from_numpy(np.stack(patches)).split(32):
            found.append(network.extract_features((batch.permute(0, 3, 1, 2).float() - 127.0) / 128.0).mean((2, 3)))
    return torch.cat(found)


def fitted(positive, negative, weights):
    """Trains a logistic regression, photographs positive. Returns the function from features to scores."""
    x, y = torch.cat([positive, negative]), torch.cat([torch.ones(len(positive)), torch.zeros(len(negative))])
    mean, spread = x.mean(0), x.std(0) + 1e-6
    x = (x - mean) / spread
    w, b = torch.zeros(x.shape[1], requires_grad=True), torch.zeros(1, requires_grad=True)
    optimizer = torch.optim.LBFGS([w, b], max_iter=200, line_search_fn="strong_wolfe")

    def loss():
        optimizer.zero_grad()
        each = torch.nn.functional.binary_cross_entropy_with_logits(x @ w + b, y, reduction="none")
        total = (weights * each).sum() / weights.sum() + PENALTY * (w * w).sum()
        total.backward()
        return total

    optimizer.step(loss)
    return lambda z: ((z - mean) / spread @ w + b).detach()


def auc(positive, negative):
    """Returns the chance that a photograph's score exceeds a rendered patch's."""
    differences = positive[:, None] - negative[None, :]
    return ((differences > 0).float() + 0.5 * (differences == 0).float()).mean().item()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--real", nargs="+", type=Path, required=True, help="two or more sets of photographs")
    parser.add_argument("--rendered", nargs="+", type=Path, required=True, help="sets of renders")
    parser.add_argument("--of", choices=["soil", "plants"], default="soil", help="what the squares hold")
    parser.add_argument("--side", type=int, default=128, help="side of a square, pixels")
    parser.add_argument("--patches", type=int, default=8, help="most squares of an image")
    parser.add_argument("--soil", type=int, default=0, help="class index of soil")
    parser.add_argument("--sheet", type=Path, help="also write a picture of the rendered squares that look least like photographs, and of those that look most like them")
    options = parser.parse_args()
    if len(options.real) < 2:
        parser.error("--real needs two sets or more: one is for testing, the others for training")
    network = EfficientNet.from_name("efficientnet-lite0")
    network.load_state_dict(load_file(WEIGHTS))
    network.eval()
    order = random.Random(1)

    def load(folder):
        images = [taken for taken in (squares(image, mask, options, order) for image, mask in pairs(folder) if mask) if taken]
        if len(images) < 2:
            raise SystemExit(f"{folder}: {len(images)} images with squares of {options.of}; at least two are needed")
        return [features(network, taken) for taken in images], [patch for taken in images for patch in taken]

    real = {folder: load(folder)[0] for folder in options.real}
    even, odd, shown = [], [], []
    for folder in options.rendered:
        images, patches = load(folder)
        even += images[0::2]
        odd += images[1::2]
        begin = 0
        for i, image in enumerate(images):
            shown += patches[begin : begin + len(image)] if i % 2 else []
            begin += len(image)
    even, odd = torch.cat(even), torch.cat(odd)
    whole = {folder: torch.cat(images) for folder, images in real.items()}
    first = {folder: torch.cat(images[0::2]) for folder, images in real.items()}
    second = {folder: torch.cat(images[1::2]) for folder, images in real.items()}

    def trained(sets):
        weights = [torch.full((len(x),), 1 / (len(sets) * len(x))) for x in sets] + [torch.full((len(even),), 1 / len(even))]
        return fitted(torch.cat(sets), even, torch.cat(weights))

    print(f"{options.of}, squares of {options.side} pixels: {len(even)} rendered for training, {len(odd)} for testing")
    print(f"  {'set':24} {'squares':>7} {'AUC unseen':>11} {'seen':>6}")
    pooled = trained(list(first.values()))
    found = []
    for folder in real:
        unseen = trained([x for name, x in whole.items() if name != folder])
        found.append((auc(unseen(whole[folder]), unseen(odd)), auc(pooled(second[folder]), pooled(odd))))
        print(f"  {folder.name:24} {len(whole[folder]):7} {found[-1][0]:11.3f} {found[-1][1]:6.3f}")
    print(f"  {'mean':24} {'':7} {np.mean(found, 0)[0]:11.3f} {np.mean(found, 0)[1]:6.3f}")
    if options.sheet:
        ranked = pooled(odd).argsort().tolist()
        side = shown[0].shape[0]
        rows = [ranked[:10], ranked[10:20], ranked[-20:-10], ranked[-10:]]
        sheet = np.full((len(rows) * side, 10 * side, 3), 255, np.uint8)
        for row, chosen in enumerate(rows):
            for column, i in enumerate(chosen):
                sheet[row * side : (row + 1) * side, column * side : (column + 1) * side] = shown[i]
        Image.fromarray(sheet).save(options.sheet)


if __name__ == "__main__":
    main()
