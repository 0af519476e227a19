#!/usr/bin/env python3
"""Compares the speed of Furrow and Mitsuba 3 on one scene: seconds until the error of the image falls below a target.

    python benches/race.py --scene scenes/field.ron                     full size; takes hours, most of them for the references
    python benches/race.py --scene scenes/field.ron --width 324 --reference-spp 1024     quick test

Needs a Python with mitsuba and numpy (`python3 -m venv target/venv && target/venv/bin/pip install mitsuba numpy`), an LLVM that
Dr.Jit can use (`apt-get install libllvm19`), and `cargo build --release`. Run it on an idle machine.

Method: `trace export` writes the scene for Mitsuba as `scene.xml`, with the same geometry, masks, textures, sun, sky,
camera and filter. It uses Mitsuba's own plugins, so materials are approximately equal (see
`crates/output/src/mitsuba/surface.rs`). Both trace paths of at most 12 surfaces. Mitsuba runs `volpath` (masks need it) in
`llvm_ad_rgb` (--variant) with the sampler, Russian roulette depth and sun weight of --sampler, --rr-depth and --sun-weight.
Each program is compared with its own long reference, which is cached in target/race/.

With `--filter box`, the default, both programs use a box filter of one pixel. With `--filter page` they use the filter of
the scene file. Furrow importance-samples a Gaussian filter, so that pixels stay independent. Mitsuba splats each sample to
all pixels around it, which lowers the error of a pixel about threefold and correlates its noise with that of its
neighbours.

Error: relMSE = mean over pixels and R, G, B of (x − ref)² / (ref² + 0.01 mean(ref)²), corrected for the noise of the
reference. Mitsuba's N reference samples are independent of the n samples of a run, so the error has an additional 1/N term,
which is removed. A run of Furrow is the start of its reference, so that a 1/N term is missing, which is added. With
stratified points both terms are smaller; the correction favours Mitsuba.

Runs of the two programs alternate, --rounds times, and medians are reported. The error falls as 1/n, which gives the number
of samples that reaches --target; a last run with this number confirms error and time. Because samples come in blocks of 16
or in squares, the number is rounded, and the compared time is the time of the last run times its error divided by the
target.

Seconds are render times. Mitsuba's kernels are compiled in a run that is not measured; its loading and compile times are
printed below the table, beside the remaining time of Furrow's process. A render by Mitsuba has a start-up time that grows
with the number of materials, so the cost of additional samples alone, times the error, is printed as well.
"""

import argparse
import contextlib
import hashlib
import math
import os
import re
import statistics
import subprocess
import sys
import time
from pathlib import Path

sys.dont_write_bytecode = True
ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "mitsuba"))


def arguments():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--scene", default="scenes/field.ron")
    parser.add_argument("--width", type=int, help="image width; default: that of the scene file")
    parser.add_argument("--height", type=int)
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256], help="numbers of samples per pixel to measure")
    parser.add_argument("--target", type=float, default=0.002, help="relMSE to reach")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--sampler", default="multijitter")
    parser.add_argument("--rr-depth", type=int, default=5)
    parser.add_argument("--sun-weight", type=float, default=16)
    parser.add_argument("--filter", choices=["box", "page"], default="box")
    parser.add_argument("--threads", type=int, default=0, help="number of threads; 0: one per core")
    parser.add_argument("--trace", default=str(ROOT / "target/release/trace"))
    parser.add_argument("--wavefront", type=int, default=1 << 24, help="maximum number of samples that Mitsuba traces at once")
    return parser.parse_args()


def read_radiance(path):
    import mitsuba as mi
    import numpy as np

    return np.array(mi.Bitmap(str(path)))[..., :3].astype(np.float64)


def relmse(x, reference):
    import numpy as np

    floor = 0.01 * reference.mean() ** 2
    return float(np.mean((x - reference) ** 2 / (reference**2 + floor)))


class Furrow:
    """Furrow's `trace`; each run is a process."""

    name = "Furrow"
    # The samples of a run are the first samples of the reference.
    share = -1

    def __init__(self, options, folder):
        self.options, self.folder = options, folder

    @staticmethod
    def possible(spp):
        """Rounds up to blocks of 16 stratified samples: part of a block would be less well stratified."""
        return math.ceil(spp / 16) * 16

    def render(self, spp, take):
        """Returns radiance and render time in seconds; `take` is ignored, because runs are deterministic."""
        out = self.folder / "ours"
        size = [f"--{k}={v}" for k in ("width", "height") if (v := getattr(self.options, k))]
        command = [self.options.trace, "--scene", self.options.scene, "--spp", str(spp), "--out", str(out)]
        command += size + [f"--threads={self.options.threads}"]
        begin = time.perf_counter()
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        whole = time.perf_counter() - begin
        if done.returncode != 0:
            sys.exit(done.stderr)
        seconds = float(re.search(r"Msamples in ([\d.]+) s", done.stderr).group(1))
        self.rest = whole - seconds
        return read_radiance(out / "radiance.exr"), seconds

    def words(self):
        return f"scene construction and output {self.rest:.1f} s"


class Mitsuba:
    """Mitsuba, in this process, so that its kernels are compiled once."""

    name = "Mitsuba 3"
    # The samples of the reference are independent of those of a run.
    share = 1

    def __init__(self, options, folder):
        self.options, self.folder = options, folder
        begin = time.perf_counter()
        from check import find_llvm

        find_llvm()
        import drjit as dr
        import mitsuba as mi

        mi.set_variant(options.variant)
        if options.threads:
            dr.set_thread_count(options.threads)
        self.mi, self.dr = mi, dr
        text = (folder / "scene" / "scene.xml").read_text()
        path = folder / "scene" / "scene-race.xml"
        path.write_text(text.replace('type="independent"', f'type="{options.sampler}"'))
        # Parallel loading starts a thread for each of thousands of textures, more than many machines allow.
        self.scene = mi.load_file(str(path), parallel=False, sun_weight=str(options.sun_weight))
        self.depth = int(re.search(r'"max_depth" value="(\d+)"', text).group(1))
        width, height = self.scene.sensors()[0].film().size()
        self.pixels = int(width) * int(height)
        self.loading = time.perf_counter() - begin
        self.compiling = 0.0
        self.compiled = {}

    @staticmethod
    def possible(spp):
        """Rounds up to a square number, as multijittered samples need."""
        return math.ceil(math.sqrt(spp)) ** 2

    def integrator(self, spp):
        """Returns an integrator whose passes fit into memory."""
        passes = next(d for d in range(1, spp + 1) if spp % d == 0 and (self.pixels * spp // d <= self.options.wavefront or d == spp))
        return self.mi.load_dict(
            {
                "type": "volpath",
                "max_depth": self.depth,
                "rr_depth": self.options.rr_depth,
                "samples_per_pass": spp // passes,
            }
        )

    def render(self, spp, take, timed=True):
        """Returns radiance and render time in seconds; if `timed`, kernels are compiled in a run before."""
        import numpy as np

        if not timed:
            return np.array(self.mi.render(self.scene, integrator=self.integrator(spp), spp=spp, seed=take)).astype(np.float64), math.nan
        if spp not in self.compiled:
            begin = time.perf_counter()
            self.compiled[spp] = self.integrator(spp)
            self.dr.eval(self.mi.render(self.scene, integrator=self.compiled[spp], spp=spp, seed=10_000))
            self.dr.sync_thread()
            self.compiling = max(self.compiling, time.perf_counter() - begin)
        begin = time.perf_counter()
        image = np.array(self.mi.render(self.scene, integrator=self.compiled[spp], spp=spp, seed=take))
        return image.astype(np.float64), time.perf_counter() - begin

    def words(self):
        return f"loading {self.loading:.1f} s, slowest first run (compiling within) {self.compiling:.1f} s"


def reference(program, options, folder, key):
    """Returns the program's reference image, read from `folder` if it was made before."""
    import numpy as np

    path = folder / f"reference-{program.name.split()[0].lower()}-{key}.npy"
    if path.exists():
        return np.load(path)
    spp = program.possible(options.reference_spp)
    print(f"{program.name}: reference of {spp} samples …", file=sys.stderr)
    if program.share < 0:
        image, _ = program.render(spp, 0)
    else:
        # Rendered in blocks of about 256 samples, each with its own seed.
        blocks = max(1, spp // 256)
        image = sum(program.render(program.possible(spp // blocks), 20_000 + k, timed=False)[0] for k in range(blocks)) / blocks
    np.save(path, image)
    return image


def fit(points, target):
    """Returns samples and seconds at which the error is `target`, for error = a / n and seconds = b n fitted at the largest n measured."""
    spp = max(points)
    error, seconds = points[spp]
    needed = max(1, math.ceil(error * spp / target))
    return needed, seconds / spp * needed


def further(points):
    """Returns the seconds per additional sample between the smallest and the largest n measured, times error and n of the largest."""
    few, many = min(points), max(points)
    return (points[many][1] - points[few][1]) / (many - few) * points[many][0] * many


@contextlib.contextmanager
def boxed(scene, wanted):
    """Yields the path of the scene file, or of a temporary copy with a box filter beside it, so that relative paths stay valid."""
    if not wanted:
        yield scene
        return
    text = (ROOT / scene).read_text()
    if re.search(r"^\s*filter\s*:", text, re.MULTILINE):
        sys.exit(f"{scene} names a filter: run with --filter page")
    copy = (ROOT / scene).with_name(f".race-{Path(scene).name}")
    copy.write_text(re.sub(r"^Field\(", "Field(\n    filter: Box,", text, count=1, flags=re.MULTILINE))
    try:
        yield str(copy)
    finally:
        copy.unlink()


def main():
    options = arguments()
    name = options.scene
    with boxed(options.scene, options.filter == "box") as options.scene:
        race(options, name)


def race(options, name):
    if not Path(options.trace).exists():
        sys.exit(f"{options.trace}: no such program; build it with: cargo build --release")
    folder = ROOT / "target" / "race" / Path(name).stem
    folder.mkdir(parents=True, exist_ok=True)
    size = [f"--{k}={v}" for k in ("width", "height") if (v := getattr(options, k))]
    export = [options.trace, "export", "--scene", options.scene, "--format", "mitsuba", "--quiet", "--out", str(folder / "scene")]
    subprocess.run(export + size, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)

    text = (folder / "scene" / "scene.xml").read_text()
    # References depend on the exported scene and, for Furrow, on the program itself.
    keys = {
        "Furrow": hashlib.sha256(Path(options.trace).read_bytes() + text.encode()),
        "Mitsuba 3": hashlib.sha256(text.encode()),
    }
    # Mitsuba first: its module also reads the images of Furrow.
    theirs = Mitsuba(options, folder)
    programs = [Furrow(options, folder), theirs]
    references = {}
    for program in programs:
        key = f"{keys[program.name].hexdigest()[:12]}-{options.reference_spp}"
        references[program.name] = reference(program, options, folder, key)

    def measure(program, spp, take):
        image, seconds = program.render(spp, take)
        raw = relmse(image, references[program.name])
        long = program.possible(options.reference_spp)
        if spp >= long:
            sys.exit(f"{spp} samples need a longer reference than {long}: --reference-spp")
        return raw * long / (long + program.share * spp), seconds

    taken = {program.name: {spp: [] for spp in options.spp} for program in programs}
    for round in range(options.rounds):
        for spp in options.spp:
            for program in programs:
                taken[program.name][spp].append(measure(program, program.possible(spp), round))
                print(f"{program.name} {spp} spp: relMSE {taken[program.name][spp][-1][0]:.5f}, {taken[program.name][spp][-1][1]:.1f} s", file=sys.stderr)

    rows = []
    for program in programs:
        points = {
            program.possible(spp): tuple(statistics.median(column) for column in zip(*runs))
            for spp, runs in taken[program.name].items()
        }
        needed, predicted = fit(points, options.target)
        needed = program.possible(needed)
        confirmed, seconds = math.nan, predicted
        if needed < program.possible(options.reference_spp):
            confirmed, taken_there = measure(program, needed, 500)
            seconds = taken_there * confirmed / options.target
        rows.append((program, points, needed, confirmed, seconds))

    ours, others = rows[0][4], rows[1][4]
    middle = sorted(options.spp)[len(options.spp) // 2]
    head = ["", f"s at {middle} spp", "Msample/s"] + [f"relMSE at {spp}" for spp in options.spp]
    head += [f"spp for {options.target:g}", "relMSE there", f"s to {options.target:g}", "ratio"]
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for program, points, needed, confirmed, seconds in rows:
        at = points[program.possible(middle)][1]
        cells = [program.name, f"{at:.1f}", f"{theirs.pixels * program.possible(middle) / at / 1e6:.2f}"]
        cells += [f"{points[program.possible(spp)][0]:.5f}" for spp in options.spp]
        cells += [str(needed), f"{confirmed:.5f}", f"{seconds:.1f}", f"{seconds / ours:.2f}"]
        print("| " + " | ".join(cells) + " |")
    print()
    for program, *_ in rows:
        print(f"{program.name}: {program.words()}")
    if len(options.spp) > 1:
        ratio = further(rows[1][1]) / further(rows[0][1])
        print(f"Time of additional samples times error, {theirs.name} over Furrow: {ratio:.2f}.")
    print(f"{name}, filter {options.filter}, {theirs.pixels} pixels, {os.cpu_count()} cores, {options.variant}, {options.sampler}; Furrow is {others / ours:.2f} times as fast.")


if __name__ == "__main__":
    main()
