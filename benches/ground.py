#!/usr/bin/env python3
"""Measures colour and structure of the ground in images with label masks.

    python benches/ground.py photos/peanut renders/field
    python benches/ground.py --images photos/peanut/images --labels photos/peanut/labels --soil 0

A set is a folder with the subfolders `images` and `labels` (PNG of class indices with the stems of the images), or the
folder of a dataset or of renders of `trace` (`rgb.png` next to `semantics.png`). Pixels whose label is `--soil` (0) and
which are at least `--apart` pixels from any other label count.

Chroma: sRGB is averaged over blocks of 4 × 4 pixels and converted to CIE Lab (D65). `a` and `b` are the standard
deviations of a* and b* over the brightest 70 % of an image's blocks, which leaves out shadows. `C` is their mean chroma.
Slope: exponent of the radial power spectrum of luminance, 4 to 32 cycles in windows of 128 pixels of soil. Contrast:
standard deviation of luminance over its mean in windows of 32 pixels. Darkest: luminance below which a thousandth of all
pixels are, over the mean luminance of the image. Printed: median and quartiles over the images.
"""

import argparse
from pathlib import Path

import numpy as np
from PIL import Image

BLOCK, BRIGHTEST, WINDOW, SMALL, DARKEST = 4, 0.7, 128, 32, 0.001
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = TO_XYZ.sum(1)
LEAST_BLOCKS = 400


def linear(srgb):
    """Returns linear values of sRGB values from 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """Returns CIE Lab under D65 of linear RGB."""
    t = rgb @ TO_XYZ.T / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def inside(mask, apart):
    """Returns the pixels of a mask at least `apart` pixels from its outside."""
    out = mask.copy()
    for _ in range(apart):
        grown = out.copy()
        grown[1:] &= out[:-1]
        grown[:-1] &= out[1:]
        grown[:, 1:] &= out[:, :-1]
        grown[:, :-1] &= out[:, 1:]
        out = grown
    return out


def windows(values, side):
    """Returns whole windows of a picture: row, column, y, x."""
    h, w = (n // side * side for n in values.shape[:2])
    return values[:h, :w].reshape(h // side, side, w // side, side, *values.shape[2:]).swapaxes(1, 2)


def chroma(rgb, soil):
    """Returns the standard deviations of a* and b*, and the mean chroma, of the brightest soil blocks."""
    whole = windows(soil, BLOCK).all((2, 3))
    if whole.sum() < LEAST_BLOCKS:
        return None
    # Blocks are averaged in sRGB, as a viewer's eye sees an image that is reduced.
    colors = lab(linear(windows(rgb, BLOCK).mean((2, 3))[whole]))
    bright = colors[colors[:, 0] >= np.quantile(colors[:, 0], 1 - BRIGHTEST)]
    return bright[:, 1].std(), bright[:, 2].std(), np.hypot(bright[:, 1], bright[:, 2]).mean()


def spectrum_slope(luminance, soil):
    """Returns the exponent of the radial power spectrum over windows that are nearly all soil."""
    power = []
    taper = np.outer(np.hanning(WINDOW), np.hanning(WINDOW))
    for values, mask in zip(windows(luminance, WINDOW).reshape(-1, WINDOW, WINDOW), windows(soil, WINDOW).reshape(-1, WINDOW, WINDOW)):
        if mask.mean() > 0.9:
            mean = values[mask].mean()
            power.append(np.abs(np.fft.fft2(np.where(mask, values / mean - 1, 0) * taper)) ** 2)
    if not power:
        return np.nan
    frequency = np.fft.fftfreq(WINDOW) * WINDOW
    radius = np.hypot(*np.meshgrid(frequency, frequency)).round().astype(int)
    rings = np.arange(4, 33)
    mean = np.mean(power, 0)
    return np.polyfit(np.log(rings), np.log([mean[radius == ring].mean() for ring in rings]), 1)[0]


def contrast(luminance, soil):
    """Returns the mean relative standard deviation of luminance in small windows of soil."""
    mask = windows(soil, SMALL)
    whole = mask.mean((2, 3)) > 0.95
    if not whole.any():
        return np.nan
    values = np.where(mask, windows(luminance, SMALL), np.nan)[whole]
    return np.mean(np.nanstd(values, (1, 2)) / np.nanmean(values, (1, 2)))


def measure(image, label, soil, apart):
    """Returns the statistics of one image, or `None` if it has too little soil."""
    rgb = np.asarray(Image.open(image).convert("RGB")) / 255.0
    ground = np.ones(rgb.shape[:2], bool) if label is None else np.asarray(Image.open(label)) == soil
    ground = inside(ground, apart)
    found = chroma(rgb, ground)
    if found is None:
        return None
    luminance = linear(rgb) @ TO_XYZ[1]
    dark = np.quantile(luminance, DARKEST) / luminance.mean()
    return *found, spectrum_slope(luminance, ground), contrast(luminance, ground), dark


def pairs(folder):
    """Returns images and their label masks in a set, by name."""
    images = sorted(p for p in folder.glob("images/*") if p.is_file())
    if images:
        labels = {p.stem: p for p in (folder / "labels").glob("*.png")}
        return [(p, labels.get(p.stem)) for p in images]
    return [(p, p.parent / "semantics.png") for p in sorted(folder.rglob("rgb.png"))]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", nargs="+", type=Path, help="folders of images and label masks")
    parser.add_argument("--soil", type=int, default=0, help="class index of soil")
    parser.add_argument("--apart", type=int, default=3, help="distance from other labels, pixels")
    parser.add_argument("--each", action="store_true", help="print a row for each image")
    options = parser.parse_args()
    print(f"{'set':24} {'images':>6} {'std a*':>17} {'std b*':>17} {'mean C*':>17} {'slope':>20} {'contrast':>17} {'darkest':>17}")
    for folder in options.sets:
        rows = []
        for image, label in pairs(folder):
            found = measure(image, label, options.soil, options.apart)
            if found is not None:
                rows.append(found)
                if options.each:
                    print(f"  {image.stem if image.stem != 'image' else image.parent.name:22}", *(f"{value:8.2f}" for value in found))
        if not rows:
            print(f"{folder.name:24} no image with enough soil")
            continue
        low, middle, high = np.nanquantile(np.array(rows), [0.25, 0.5, 0.75], axis=0)
        columns = (f"{m:5.2f} ({l:5.2f}{h:6.2f})" for l, m, h in zip(low, middle, high))
        print(f"{folder.name:24} {len(rows):6} ", "  ".join(columns))


if __name__ == "__main__":
    main()
