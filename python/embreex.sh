#!/usr/bin/env bash
# Downloads Embree 4.4 and TBB, built for glibc 2.27, from the PyPI package `embreex` to target/embreex; prints the folder for EMBREE_DIR.
set -euo pipefail
cd "$(dirname "$0")/.."
embree=$PWD/target/embreex
python3 -m pip install -q --no-deps --upgrade --target "$embree" --only-binary :all: --python-version 3.11 --platform manylinux_2_28_x86_64 \
  --require-hashes -r python/embreex.txt >&2
echo "$embree/embreex.libs"
