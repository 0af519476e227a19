#!/usr/bin/env python3
"""Compares two builds of `trace` by noise and render time.

    python benches/noise.py OLD NEW scenes/field.ron scenes/04-weeds.ron

Both builds render each scene file with equal sizes and numbers of samples.

Error: relMSE as in `race.py`, against a long render by OLD with independent samples (`--without qmc`), which shares no
samples with either. A long run with OLD's own points would start with the samples under test, and the correction for that
is between 0 and n/N, depending on how well the points are stratified. The noise of the reference is estimated from n of its
own samples and subtracted from both errors. Few pixels may dominate the mean, so it is also reported without the worst
thousandth of the pixels, which varies less between sample sets.

Time: core seconds of the process minus those of a render with one sample per pixel, which is mostly scene construction. Efficiency is
1 / (error × time): twice the efficiency reaches an error in half the time. Needs a Python with mitsuba and numpy, as `race.py` does.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))

import mitsuba

mitsuba.set_variant("scalar_rgb")
from race import ROOT, read_radiance


def render(program, scene, spp, options, *more):
    """Returns the radiance and the core seconds of the process."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "--scene", scene, "--spp", str(spp), "--width", str(options.width), "--out", folder, "--quiet", *more]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return read_radiance(Path(folder) / "radiance.exr"), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def errors(image, reference):
    """Returns the relMSE of all pixels, and without the worst thousandth of them."""
    each = np.sort(((image - reference) ** 2 / (reference**2 + 0.01 * reference.mean() ** 2)).mean(-1), axis=None)
    return np.array([each.mean(), each[: int(len(each) * 0.999)].mean()])


def independent_reference(program, scene, options):
    """Returns a long render with independent samples, and its own errors."""
    n, long = options.spp, options.reference_spp
    reference, beginning = (render(program, scene, spp, options, "--without", "qmc")[0] for spp in (long, n))
    # For independent samples of variance v, the first n of N differ from all N by v/n − v/N; the error of all N is v/N.
    return reference, errors(beginning, reference) * n / (long - n)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("old", help="reference build of trace")
    parser.add_argument("new", help="build to compare with it")
    parser.add_argument("scenes", nargs="+", help="scene files")
    parser.add_argument("--width", type=int, default=324)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    programs = [str(Path(p).resolve()) for p in (options.old, options.new)]
    print("| scene file | error | without the worst pixels | time | efficiency |\n|---|---|---|---|---|")
    for scene in options.scenes:
        reference, noise = independent_reference(programs[0], scene, options)
        error = [errors(render(program, scene, options.spp, options)[0], reference) - noise for program in programs]
        taken = [[], []]
        for _ in range(options.rounds):
            for k, program in enumerate(programs):
                long, short = (render(program, scene, spp, options)[1] for spp in (options.spp, 1))
                taken[k].append(long - short)
        seconds = [float(np.median(column)) for column in taken]
        (e, most), t = error[1] / error[0], seconds[1] / seconds[0]
        print(f"| `{Path(scene).name}` | {e:.2f} | {most:.2f} | {t:.2f} | {1 / (e * t):.2f} |", flush=True)


if __name__ == "__main__":
    main()
