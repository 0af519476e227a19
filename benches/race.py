#!/usr/bin/env python3
"""Races Furrow against Mitsuba 3 on one scene: seconds until the image's error falls below a bound.

    python benches/race.py --scene scenes/field.ron                     the claim: full size, some hours with its references
    python benches/race.py --scene scenes/field.ron --width 324 --reference-spp 1024     a quick look

It needs a Python with mitsuba and numpy (`python3 -m venv target/venv && target/venv/bin/pip install mitsuba numpy`), an LLVM that
Dr.Jit can use (`apt-get install libllvm19`), and `cargo build --release`. Run it on a quiet machine.

What is done: `trace export` writes the scene for Mitsuba (`scene.xml`: its own plugins, so materials are about equal, see
`src/output/mitsuba/surface.rs`; same geometry, masks, textures, sun, sky, camera and filter). Both path trace to the same depth, 12 surfaces.
Mitsuba runs `volpath` (masks need it) in `llvm_ad_rgb` (--variant) with the sampler, roulette and weight of the sun given by
--sampler, --rr-depth and --sun-weight. Each is measured against its own long reference, rendered with other seeds, which is kept
under target/race/ and used again.

With `--filter box`, the default, a pixel gathers its own square in both programs. With `--filter page` it gathers as the page says: of a
Gaussian ours draws the samples, so that pixels stay independent, while Mitsuba lets each sample count in all pixels around, which lowers
the error of a pixel about threefold and ties its noise to that of its neighbours.

Error: relMSE = mean over pixels and R, G, B of (x − ref)² / (ref² + 0.01 mean(ref)²), put right for the noise of the
reference: Mitsuba's N samples are others than the n of a run, so 1/N is too much; Furrow's run is the beginning of its reference, so 1/N is
missing (with stratified points less than that, for both: what is put right favours Mitsuba). Runs of the two alternate, --rounds times;
medians are shown. From the errors, which fall as 1/n, follow the
samples that reach --target; a last run with that many confirms error and time. As samples come in blocks of 16 or in squares, it has
some too many or too few: its seconds times its error over the target are compared. Seconds are those of rendering; Mitsuba's first
kernels are compiled before, and their time and that of loading stand below the table, beside the whole time of Furrow's process.
A render of Mitsuba's takes some time before its first sample, more of it with many materials; what further samples alone cost, times the
error, stands below the table too.
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
    parser.add_argument("--width", type=int, help="image width; the page's unless given")
    parser.add_argument("--height", type=int)
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256], help="samples that are measured")
    parser.add_argument("--target", type=float, default=0.002, help="relMSE to reach")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--variant", default="llvm_ad_rgb")
    parser.add_argument("--sampler", default="multijitter")
    parser.add_argument("--rr-depth", type=int, default=5)
    parser.add_argument("--sun-weight", type=float, default=16)
    parser.add_argument("--filter", choices=["box", "page"], default="box")
    parser.add_argument("--threads", type=int, default=0, help="0: one for each core")
    parser.add_argument("--trace", default=str(ROOT / "target/release/trace"))
    parser.add_argument("--wavefront", type=int, default=1 << 24, help="most samples that Mitsuba traces at once")
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
    """`trace`, a process for each run."""

    name = "Furrow"
    # A run is the beginning of the reference.
    share = -1

    def __init__(self, options, folder):
        self.options, self.folder = options, folder

    @staticmethod
    def possible(spp):
        """Stratified samples come in blocks of 16: a part of a block is less even than its number tells."""
        return math.ceil(spp / 16) * 16

    def render(self, spp, take):
        """Radiance, seconds of rendering; `take` is not looked at: equal runs are equal."""
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
        return f"growing, building and writing {self.rest:.1f} s"


class Mitsuba:
    """Mitsuba in a process that stays: its kernels are compiled once."""

    name = "Mitsuba 3"
    # The reference has samples of its own.
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
        # Loading in parallel takes a thread for each of thousands of textures, more than many machines allow.
        self.scene = mi.load_file(str(path), parallel=False, sun_weight=str(options.sun_weight))
        self.depth = int(re.search(r'"max_depth" value="(\d+)"', text).group(1))
        width, height = self.scene.sensors()[0].film().size()
        self.pixels = int(width) * int(height)
        self.loading = time.perf_counter() - begin
        self.compiling = 0.0
        self.compiled = {}

    @staticmethod
    def possible(spp):
        """Multijittered samples come in squares."""
        return math.ceil(math.sqrt(spp)) ** 2

    def integrator(self, spp):
        """Passes small enough for the memory."""
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
        """Radiance, seconds of rendering; with compiled kernels where time counts."""
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
    """The program's long run, read from `folder` where it was made before."""
    import numpy as np

    path = folder / f"reference-{program.name.split()[0].lower()}-{key}.npy"
    if path.exists():
        return np.load(path)
    spp = program.possible(options.reference_spp)
    print(f"{program.name}: reference of {spp} samples …", file=sys.stderr)
    if program.share < 0:
        image, _ = program.render(spp, 0)
    else:
        # In blocks, so that a lost hour is not a lost night.
        blocks = max(1, spp // 256)
        image = sum(program.render(program.possible(spp // blocks), 20_000 + k, timed=False)[0] for k in range(blocks)) / blocks
    np.save(path, image)
    return image


def fit(points, target):
    """Samples and seconds at which the error is `target`: error = a / n, seconds = b n, both by the largest n measured."""
    spp = max(points)
    error, seconds = points[spp]
    needed = max(1, math.ceil(error * spp / target))
    return needed, seconds / spp * needed


def further(points):
    """Seconds of a sample between the fewest and the most that were measured, times error and number of the most."""
    few, many = min(points), max(points)
    return (points[many][1] - points[few][1]) / (many - few) * points[many][0] * many


@contextlib.contextmanager
def boxed(scene, wanted):
    """The page's path, or that of a copy beside it whose pixels gather their own square; paths in it count from its folder."""
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
        sys.exit(f"{options.trace}: there is no such program; build it: cargo build --release")
    folder = ROOT / "target" / "race" / Path(name).stem
    folder.mkdir(parents=True, exist_ok=True)
    size = [f"--{k}={v}" for k in ("width", "height") if (v := getattr(options, k))]
    export = [options.trace, "export", "--scene", options.scene, "--format", "mitsuba", "--quiet", "--out", str(folder / "scene")]
    subprocess.run(export + size, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)

    text = (folder / "scene" / "scene.xml").read_text()
    # References belong to one scene, size and renderer: to what the export says, and for ours to the program itself.
    keys = {
        "Furrow": hashlib.sha256(Path(options.trace).read_bytes() + text.encode()),
        "Mitsuba 3": hashlib.sha256(text.encode()),
    }
    # Mitsuba first: its module reads our images too.
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
        print(f"Seconds that further samples take, times the error: {ratio:.2f} times as many with {theirs.name}.")
    print(f"{name}, filter {options.filter}, {theirs.pixels} pixels, {os.cpu_count()} cores, {options.variant}, {options.sampler}; Furrow is {others / ours:.2f} times as fast.")


if __name__ == "__main__":
    main()
