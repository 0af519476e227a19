"""Compares Furrow's radiance with Mitsuba's: python check.py OUT TOLERANCE FOLDER/SCENE.xml ...

Each folder holds an exported scene and `ours.bin`: for each pixel R, G, B, NIR, the variances of these means, class, plant
and leaf, float32.
The estimated quantity is the ratio of two means over a region: each class, and each plant and leaf of at least 40 pixels. Leaves
are tested because errors of a large leaf and a small one may cancel over their plant.
Mitsuba renders BLOCKS independent images at once: loading a field and translating its BSDFs takes longer than many samples. Its
pixels use independent random numbers, so the variance of a region's mean is the sum of its pixels' variances. Our image uses Sobol
points; its reported variance, that of independent samples, is not below the true one: over 16 seeds the true standard error was
half the reported one for a beet under lamps, and 0.5 to 1.0 of it for its leaves.
- Labels: the surface at each pixel's centre has the same class and plant, except in one pixel in a thousand.
- Regions: the difference is below TOLERANCE of the mean (0 where the scene is exact) plus a limit in standard errors, which a
  correct scene exceeds with probability FALSE_ALARM: Student's t, divided among all regions and bands of the scene (Bonferroni),
  with the degrees of freedom of the measured variances (Welch & Satterthwaite). If a few bright pixels dominate a variance, these
  are few and the limit is wide: 8 standard errors for a leaf in the sun, whose glint Mitsuba finds by chance. Under lamps they are
  thousands: over 64 images of a beet its mean is practically normal (skewness −0.4 to 0.1, excess kurtosis below 0.5, standard
  deviation 1.08 times the reported one).
- Pixels: at most 0.5 % exceed the limit that t exceeds with probability 0.05 %, or 3 % if TOLERANCE is above 0.
A scene that disagrees leaves images in OUT: ours, theirs, z. Exit code 1.
"""

import glob
import os
import re
import sys
import time

sys.dont_write_bytecode = True
BLOCKS = 8
# Samples per pixel and block.
SPP = 24
# Samples per pixel of our image, as rendered by the test.
SPP_OURS = 128
# Probability that the regions of a correct scene fail.
FALSE_ALARM = 1e-5


def find_llvm():
    """Selects the newest LLVM for Dr.Jit; version 15 of Debian 12 aborts on recent processors."""
    if "DRJIT_LIBLLVM_PATH" in os.environ:
        return
    paths = glob.glob("/usr/lib/*/libLLVM[-.]*so*") + glob.glob("/usr/lib/llvm-*/lib/libLLVM*.so*")
    version = lambda path: max([int(n) for n in re.findall(r"(?:LLVM-|so\.|llvm-)(\d+)", path)] or [0])
    paths = [path for path in paths if version(path) >= 16]
    if paths:
        os.environ["DRJIT_LIBLLVM_PATH"] = max(paths, key=version)


find_llvm()
import drjit as dr
import mitsuba as mi
import numpy as np
from scipy import stats

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bsdfs


def labels(scene, width, height):
    """Class name and plant of the surface at each pixel's centre, with masks applied."""
    sensor = scene.sensors()[0]
    k = dr.arange(mi.UInt32, width * height)
    at = mi.Point2f((mi.Float(k % width) + 0.5) / width, (mi.Float(k // width) + 0.5) / height)
    ray, _ = sensor.sample_ray(0.0, 0.5, at, mi.Point2f(0.5))
    found = np.zeros(width * height, np.uint32)
    for _ in range(256):
        si = scene.ray_intersect(ray)
        clear = si.bsdf(ray).eval_null_transmission(si, si.is_valid())
        solid = si.is_valid() & (clear.x < 0.5)
        ids = np.array(dr.reinterpret_array(mi.UInt32, si.shape))
        found = np.where((found == 0) & np.array(solid), ids, found)
        through = si.is_valid() & ~solid
        if not dr.any(through):
            break
        ray = si.spawn_ray(ray.d)
        ray.maxt = dr.select(through, ray.maxt, -1.0)
    names = {}
    for shape in scene.shapes():
        names[int(np.array(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape)))[0])] = shape.id()
    keys = np.zeros((width * height, 2), np.int32)
    for shape, name in names.items():
        parts = name.split("-")
        if len(parts) == 3 and parts[0] in ("soil", "crop", "weed"):
            keys[found == shape] = ("soil crop weed".split().index(parts[0]), int(parts[1]))
    return keys.reshape(height, width, 2)


def render(scene, bands):
    """Renders BLOCKS independent images of a scene; axes: row, column, block, band."""
    sensor = scene.sensors()[0]
    width, height = (int(side) for side in sensor.film().size())
    samples = width * height * BLOCKS * SPP
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, samples)
    pixel = dr.arange(mi.UInt32, samples) // (BLOCKS * SPP)
    at = (mi.Point2f(pixel % width, pixel // width) + sampler.next_2d()) / mi.Point2f(width, height)
    ray, weight = sensor.sample_ray_differential(0.0, sampler.next_1d(), at, sampler.next_2d())
    radiance = weight * scene.integrator().sample(scene, sampler, ray)[0]
    of_blocks = [dr.block_reduce(dr.ReduceOp.Add, radiance[band], SPP) / SPP for band in range(bands)]
    return np.stack(of_blocks, -1).astype(float).reshape(height, width, BLOCKS, bands)


def compare(path, tolerance, out):
    """Returns whether the two agree, and prints a line for each region."""
    begin = time.time()
    # Without merging: merged shapes would lose their names, which hold the labels.
    scene = mi.load_file(path, optimize=False)
    width, height = scene.sensors()[0].film().size()
    width, height = int(width), int(height)
    ours = np.fromfile(os.path.join(os.path.dirname(path), "ours.bin"), np.float32).reshape(height, width, 11)
    bands = [3] if "nir" in os.path.basename(path) else [0, 1, 2]
    mean, variance = ours[..., bands].astype(float), ours[..., [4 + b for b in bands]].astype(float)
    keys, leaves = ours[..., 8:10].astype(np.int32), ours[..., 10].astype(np.int32)
    blocks = render(scene, len(bands))
    theirs, error = blocks.mean(2), blocks.var(2, ddof=1) / BLOCKS

    faults = []
    differ = np.any(labels(scene, width, height) != keys, axis=-1)
    print(f"{path}: {100 * differ.mean():.3f} % of the labels differ")
    if differ.mean() > 1e-3:
        faults.append("labels differ")
    z = (mean - theirs) / np.sqrt(variance + error + 1e-12 * theirs.max() ** 2)
    limit = stats.t.isf(0.5 * 5e-4, BLOCKS - 1)
    far = np.mean(np.abs(z) > limit)
    print(f"    pixels: z of mean {z.mean():+.3f}, spread {z.std():.2f}, {100 * far:.2f} % beyond {limit:.1f}")
    if far > (0.03 if tolerance > 0 else 0.005):
        faults.append("pixels differ")
    regions = [(name, keys[..., 0] == c) for c, name in enumerate(("soil", "crop", "weed"))]
    for plant in np.unique(keys[..., 1][keys[..., 1] > 0]):
        of = keys[..., 1] == plant
        regions.append((f"plant {plant}", of))
        regions += [(f"leaf {plant}.{leaf}", of & (leaves == leaf)) for leaf in np.unique(leaves[of])]
    regions = [region for region in regions if region[1].sum() >= 40]
    chance = FALSE_ALARM / (len(regions) * len(bands))
    for name, where in regions:
        a, b = mean[where].mean(0), theirs[where].mean(0)
        # One row per pixel: its variance, ours and theirs, and the degrees of freedom of each.
        variances = np.concatenate([variance[where], error[where]])
        freedom = np.repeat([[SPP_OURS - 1], [BLOCKS - 1]], where.sum(), axis=0)
        sigma = np.sqrt(variances.sum(0)) / where.sum()
        freedom = variances.sum(0) ** 2 / np.maximum((variances**2 / freedom).sum(0), 1e-300)
        limit = stats.t.isf(0.5 * chance, np.maximum(freedom, 1))
        bad = np.any(np.abs(a - b) > limit * sigma + tolerance * b)
        say = lambda v, f: " ".join(f.format(x) for x in v)
        ratio = say(a / np.maximum(b, 1e-9), "{:.4f}")
        print(f"    {name:10} {where.sum():6} pixels  ours/theirs {ratio}  ± {say(sigma / np.maximum(b, 1e-9), '{:.4f}')}, within {limit.max():.1f} of them{'  DIFFERS' if bad else ''}")
        if bad:
            faults.append(f"{name} differs")
    print(f"    {time.time() - begin:.1f} s")
    if faults:
        name = "-".join(path.split(os.sep)[-2:]).replace(".xml", "")
        os.makedirs(out, exist_ok=True)
        white = 3 * theirs.mean() + 1e-9
        pictures = {"ours": mean / white, "theirs": theirs / white, "z": 0.5 + z / 18}
        for what, pixels in pictures.items():
            colour = np.broadcast_to(pixels.mean(-1, keepdims=True) if len(bands) == 1 else pixels, (height, width, 3))
            bitmap = mi.Bitmap(np.ascontiguousarray(np.clip(colour, 0, 1), np.float32))
            gamma = what != "z"
            bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, gamma)
            bitmap.write(os.path.join(out, f"{name}-{what}.png"))
        print(f"    {', '.join(faults)}; see {out}/{name}-*.png")
    return not faults


if __name__ == "__main__":
    out, tolerance = sys.argv[1], float(sys.argv[2])
    agree = [compare(path, tolerance, out) for path in sys.argv[3:]]
    sys.exit(0 if all(agree) else 1)
