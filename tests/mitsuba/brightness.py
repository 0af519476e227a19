"""Compares the mean radiance of scene.xml and scene-exact.xml: python brightness.py TOLERANCE FOLDER ...

Mitsuba renders both, so only the BSDFs differ. With 48 samples per pixel, the means of these images are accurate to 0.2 %.
"""

import sys

sys.dont_write_bytecode = True
import check  # selects LLVM and the variant, registers our plugins
import mitsuba as mi
import numpy as np


def mean(path, seed):
    return np.array(mi.render(mi.load_file(path), spp=48, seed=seed))[..., :3].mean()


def main():
    tolerance, folders = float(sys.argv[1]), sys.argv[2:]
    wrong = False
    for folder in folders:
        ratio = mean(f"{folder}/scene.xml", 1) / mean(f"{folder}/scene-exact.xml", 2)
        wrong |= not abs(ratio - 1) <= tolerance
        print(f"{folder}: scene.xml is {ratio:.4f} times as bright as scene-exact.xml")
    sys.exit(wrong)


if __name__ == "__main__":
    main()
