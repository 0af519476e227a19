#!/usr/bin/env python3
"""Makes a dataset with most options of `trace dataset`, as a data team would, and reports the time of each step.

    python benches/order.py target/release/trace out/order
    python benches/order.py target/release/trace out/order --count 200 --width 240 --spp 4

The steps are: cost estimate; a run with user-defined classes, size limits, packs and pushing, killed once in the middle;
status; verification with images rendered again; the same dataset in folders, whose files must equal those in the packs;
further formats; a dataset without most label maps; a stream. It needs only Python's standard library and exits with 1 if a
step fails or bytes differ. The pushed files are in OUT/pushed.
"""

import argparse
import hashlib
import json
import resource
import shutil
import signal
import subprocess
import sys
import tarfile
import time
from pathlib import Path

CLASSES = "soil; beet=BEAVX; fat hen=CHEAL; grass=ECHCG; weed; ignore=stone"


def run(name, command, **options):
    """Runs a command to its end, prints the start of its row, and returns its output."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    done = subprocess.run([str(part) for part in command], capture_output=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"{name}: exit code {done.returncode}\n{done.stderr.decode(errors='replace')}")
    core = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"| {name} | {time.monotonic() - began:.1f} | {core:.1f} | ", end="")
    return done.stdout


def row(text):
    print(f"{text} |", flush=True)


def size(folder):
    """Returns MB and number of the files of a folder; hard links to one file are counted once."""
    files = {(s.st_dev, s.st_ino): s.st_size for s in (p.stat() for p in Path(folder).rglob("*") if p.is_file())}
    return f"{sum(files.values()) / 1e6:.1f} MB in {len(files)} files"


def samples(folder):
    """Returns the hashes of the images' files by `NUMBER.FILE`, from packs or folders."""
    found = {}
    for pack in sorted(Path(folder, "packs").glob("*.tar")):
        with tarfile.open(pack) as archive:
            for entry in archive:
                found[entry.name] = hashlib.sha256(archive.extractfile(entry).read()).hexdigest()
    for file in Path(folder, "images").glob("*/*"):
        found[f"{file.parent.name}.{file.name}"] = hashlib.sha256(file.read_bytes()).hexdigest()
    return found


def kill_in_the_middle(command, packs):
    """Kills a run once it has finished a pack, as a power failure would."""
    began = time.monotonic()
    with subprocess.Popen([str(part) for part in command], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as running:
        while running.poll() is None and not list(packs.glob("*.tar")):
            time.sleep(0.2)
        if running.poll() is not None:
            sys.exit("the run ended before it could be killed: use a larger --count")
        running.send_signal(signal.SIGKILL)
    print(f"| the run, killed after its first archive | {time.monotonic() - began:.1f} | | ", end="")
    row(f"{len(list(packs.glob('*.tar')))} archives")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("trace", help="a build of trace")
    parser.add_argument("out", type=Path, help="folder to create; it must not exist")
    parser.add_argument("--scene", default="synthetic-d")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--width", type=int, default=240)
    parser.add_argument("--spp", type=int, default=4)
    parser.add_argument("--pack", type=int, default=50)
    options = parser.parse_args()
    trace, out = Path(options.trace).resolve(), options.out.resolve()
    out.mkdir(parents=True)
    pushed = out / "pushed"
    order = ["--scene", options.scene, "--count", options.count, "--width", options.width, "--spp", options.spp]
    order += ["--format", "coco,yolo,yolo-detect,yolo-pose", "--classes", CLASSES, "--min-pixels", 5, "--photo", "jpeg95"]
    push = ["--push", f"mkdir -p '{pushed}' && cp -a {{dir}}/. '{pushed}/'", "--push-check", f"diff -r {{dir}} '{pushed}' | grep -v '^Only in {pushed}' | (! grep .)"]
    packed, folders, least = out / "packed", out / "folders", out / "least"
    print("| step | s | core s | result |\n|---|---|---|---|")

    told = run("`--dry-run`", [trace, "dataset", *order, "--out", packed, "--pack", options.pack, "--dry-run"]).decode()
    row("; ".join(line.strip() for line in told.splitlines() if "core" in line or "memory" in line or "disk" in line) or "cost estimate")
    whole = [trace, "dataset", *order, "--out", packed, "--pack", options.pack, *push, "--quiet"]
    kill_in_the_middle(whole, packed / "packs")
    run("the same command again, pushing", whole)
    row(size(packed))
    status = json.loads(run("`status --json`", [trace, "dataset", "status", packed, "--json"]))
    row(f"{status['done']} of {options.count} images")
    run("`verify --rerender 2`", [trace, "dataset", "verify", packed, "--rerender", 2])
    row("no fault")
    run("`verify` of the pushed files", [trace, "dataset", "verify", pushed])
    row(size(pushed))

    run("the same set in folders", [trace, "dataset", *order, "--out", folders, "--quiet"])
    row(size(folders))
    here, there = samples(packed), samples(folders)
    if not here or here != there:
        sys.exit("files of packs and folders differ: " + ", ".join(sorted(set(here.items()) ^ set(there.items()))[0]))
    print(f"| files in packs compared with those in folders | | | {len(here)} equal |")
    run("`finish --format phenobench,voc,cityscapes`", [trace, "dataset", "finish", folders, "--format", "phenobench,voc,cityscapes", "--quiet"])
    row(size(folders))

    least_order = [part if part != "coco,yolo,yolo-detect,yolo-pose" else "imagefolder" for part in order]
    run("RGB image and class map only", [trace, "dataset", *least_order, "--keep", "rgb,semantics", "--out", least, "--quiet"])
    row(size(least))
    shutil.rmtree(least)
    stream = run("`stream`, read to its end", [trace, "stream", "--scene", options.scene, "--count", options.count, "--width", options.width, "--spp", 1, "--quiet"])
    row(f"{len(stream) / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
