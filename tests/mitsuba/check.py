"""Compares Furrow's radiance with Mitsuba's: python check.py OUT TOLERANCE FOLDER/SCENE.xml ...

Each folder holds an exported scene and `ours.bin`: for each pixel R, G, B, NIR, the variances of these means, class and
plant, float32. Mitsuba renders the scene in blocks of other seeds, whose spread gives the error of its mean.

- Labels: the surface at each pixel's centre is of the same class and plant, but for one pixel in a thousand.
- Regions: the mean over each class, and over each plant of at least 40 pixels, agrees within 4.5 standard errors and
  TOLERANCE of the mean (0 where the scene is exact).
- Pixels: no more than 0.5 % lie beyond 4.5 standard errors, 3 % where TOLERANCE is above 0. Twice the 16 blocks' t distribution leaves 0.05 %.

A scene that disagrees leaves pictures in OUT: ours, theirs, z. Exit code 1.
"""

import glob
import os
import re
import sys
import time

sys.dont_write_bytecode = True
BLOCKS = 16
SPP = int(os.environ.get("FURROW_CHECK_SPP", "8"))


def find_llvm():
    """Names the newest LLVM to Dr.Jit; the 15 of Debian 12 aborts on recent processors."""
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

mi.set_variant("llvm_ad_rgb")
mi.set_log_level(mi.LogLevel.Error)
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import bsdfs


def labels(scene, width, height):
    """Class name and plant of the surface at each pixel's centre, through masks."""
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


def compare(path, tolerance, out):
    """Whether the two agree, and a line for each region."""
    begin = time.time()
    scene = mi.load_file(path)
    width, height = scene.sensors()[0].film().size()
    width, height = int(width), int(height)
    ours = np.fromfile(os.path.join(os.path.dirname(path), "ours.bin"), np.float32).reshape(height, width, 10)
    bands = [3] if "nir" in os.path.basename(path) else [0, 1, 2]
    mean, variance = ours[..., bands].astype(float), ours[..., [4 + b for b in bands]].astype(float)
    keys = ours[..., 8:10].astype(np.int32)
    blocks = [np.array(mi.render(scene, spp=SPP, seed=k)).astype(float)[..., : len(bands)] for k in range(BLOCKS)]
    blocks = np.stack([b.reshape(height, width, len(bands)) for b in blocks])
    theirs, error = blocks.mean(0), blocks.var(0, ddof=1) / BLOCKS

    faults = []
    differ = np.any(labels(scene, width, height) != keys, axis=-1)
    print(f"{path}: {100 * differ.mean():.3f} % of the labels differ")
    if differ.mean() > 1e-3:
        faults.append("labels differ")
    z = (mean - theirs) / np.sqrt(variance + error + 1e-12 * theirs.max() ** 2)
    far = np.mean(np.abs(z) > 4.5)
    print(f"    pixels: z of mean {z.mean():+.3f}, spread {z.std():.2f}, {100 * far:.2f} % beyond 4.5")
    if far > (0.03 if tolerance > 0 else 0.005):
        faults.append("pixels differ")
    regions = [(name, keys[..., 0] == c) for c, name in enumerate(("soil", "crop", "weed"))]
    regions += [(f"plant {p}", keys[..., 1] == p) for p in np.unique(keys[..., 1]) if p > 0]
    for name, where in regions:
        if where.sum() < 40:
            continue
        a, b = mean[where].mean(0), theirs[where].mean(0)
        of_blocks = blocks[:, where].mean(1)
        sigma = np.sqrt(variance[where].sum(0) / where.sum() ** 2 + of_blocks.var(0, ddof=1) / BLOCKS)
        bad = np.any(np.abs(a - b) > 4.5 * sigma + tolerance * b)
        say = lambda v, f: " ".join(f.format(x) for x in v)
        ratio = say(a / np.maximum(b, 1e-9), "{:.4f}")
        print(f"    {name:9} {where.sum():6} pixels  ours/theirs {ratio}  ± {say(sigma / np.maximum(b, 1e-9), '{:.4f}')}{'  DIFFERS' if bad else ''}")
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
