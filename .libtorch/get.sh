#!/bin/sh
# Puts the CPU libtorch that the feature `train` links against beside this script: 544 MB to download, 498 MB on disk, no root, no Python
# package installed, nothing to do the second time. Linux x86_64, glibc 2.28 or newer, any Python 3.8 or newer with pip or venv.
# PyPI has one torch for Linux, that for CUDA: its two CPU libraries are cut out of the wheel, with the two small ones they ask for.
set -eu
here=$(CDPATH= cd -- "$(dirname -- "$0")" && pwd)
version=2.11.0
if [ "$(cat "$here/build-version" 2>/dev/null || true)" = "$version" ]; then exit 0; fi
[ "$(uname -sm)" = "Linux x86_64" ] || { echo "only Linux on x86_64 is known here; export LIBTORCH=DIR with a libtorch $version of yours" >&2; exit 1; }
work=$(mktemp -d "$here/.tmp.XXXXXX")
trap 'rm -rf "$work"' EXIT INT TERM
pip="python3 -m pip"
$pip --version >/dev/null 2>&1 || { python3 -m venv "$work/venv"; pip="$work/venv/bin/python -m pip"; }
echo "downloading libtorch $version: 544 MB" >&2
# The Python of the wheel (cp311) matters only for a library that is thrown away.
$pip download -q --disable-pip-version-check --no-cache-dir --no-deps --only-binary=:all: --require-hashes \
  --python-version 3.11 --implementation cp --abi cp311 --abi none \
  --platform manylinux_2_28_x86_64 --platform manylinux_2_27_x86_64 --platform manylinux_2_25_x86_64 \
  --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 -d "$work" -r "$here/requirements.txt"
python3 - "$work" "$here" <<'P'
import glob, os, shutil, sys, zipfile
work, here = sys.argv[1:]
lib = os.path.join(here, "lib")
keep = {"libtorch_cpu.so", "libc10.so", "libgomp.so.1", "libcudart.so.13", "libcupti.so.13"}
def put(archive, item, path):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with archive.open(item) as source, open(path, "wb") as target:
        shutil.copyfileobj(source, target, 1 << 20)
for wheel in glob.glob(work + "/*.whl"):
    with zipfile.ZipFile(wheel) as archive:
        for item in archive.infolist():
            name = os.path.basename(item.filename)
            if name in keep:
                put(archive, item, os.path.join(lib, name))
            elif item.filename.startswith("torch/include/") and not item.is_dir():
                put(archive, item, os.path.join(here, item.filename[len("torch/"):]))
missing = keep - set(os.listdir(lib))
if missing:
    sys.exit(f"the wheels lack {sorted(missing)}")
# torch-sys links -ltorch; the wheel's own libtorch.so would ask for the CUDA libraries.
link = os.path.join(lib, "libtorch.so")
if not os.path.lexists(link):
    os.symlink("libtorch_cpu.so", link)
P
echo "$version" > "$here/build-version" # last: torch-sys compares it with its own
echo "libtorch $version is in $here" >&2
