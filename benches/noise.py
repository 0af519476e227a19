#!/usr/bin/env python3
"""Compares two builds of `trace` by the noise that they leave for the time that they take.

    python benches/noise.py OLD NEW scenes/field.ron scenes/04-weeds.ron

For each scene file both render the same pixels with as many samples. Error: relMSE as in `race.py`, against a long render by OLD with
independent numbers (`--without qmc`), which has no sample of either. A long run of OLD's own points begins with the samples that are judged, and
what is to be put right for that lies between nothing and n/N, by how well the points are spread. The reference's own noise is estimated by n
of its own samples and taken off both errors. A few pixels may decide a mean: beside it stands that without the worst thousandth of pixels, which
differs less from one set of samples to another.
Time: core seconds of the process less those of one sample a pixel, which growing and building take. Efficiency is
1 / (error × time): at twice of it an error is reached in half the time. It needs a Python with mitsuba and numpy, as `race.py` does.
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
    """Radiance, and the core seconds of the process."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "--scene", scene, "--spp", str(spp), "--width", str(options.width), "--out", folder, "--quiet", *more]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode != 0:
            sys.exit(done.stderr)
        return read_radiance(Path(folder) / "radiance.exr"), resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def errors(image, reference):
    """relMSE of all pixels, and without the worst thousandth of them."""
    each = np.sort(((image - reference) ** 2 / (reference**2 + 0.01 * reference.mean() ** 2)).mean(-1), axis=None)
    return np.array([each.mean(), each[: int(len(each) * 0.999)].mean()])


def independent_reference(program, scene, options):
    """A long render with independent numbers, and its own errors."""
    n, long = options.spp, options.reference_spp
    reference, beginning = (render(program, scene, spp, options, "--without", "qmc")[0] for spp in (long, n))
    # Of independent samples the first n of N err by v/n − v/N against all of them, which err by v/N.
    return reference, errors(beginning, reference) * n / (long - n)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("old", help="a build of trace")
    parser.add_argument("new", help="another one")
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
