#!/bin/sh
# Runs the tests of the unsafe code, the bindings of Embree (crates/embree) and of Open Image Denoise
# (crates/output/src/denoise/oidn), with AddressSanitizer: sh fuzz/sanitize.sh
set -eu
cd "$(dirname "$0")/.."
# RUSTC_BOOTSTRAP permits the sanitizer's flag on a stable compiler. Leaks are not reported, because Embree never joins its
# worker threads. Duplicate symbols are not reported, because FLIP's tinyexr defines one twice and no program would start.
export RUSTC_BOOTSTRAP=1
export RUSTFLAGS="-Ctarget-cpu=x86-64-v3 -Zsanitizer=address"
export ASAN_OPTIONS="detect_leaks=0:detect_odr_violation=0:detect_stack_use_after_return=1"
cargo test --target x86_64-unknown-linux-gnu --target-dir fuzz/target/asan -p furrow-embree --tests
cargo test --target x86_64-unknown-linux-gnu --target-dir fuzz/target/asan --features system-tests --test system "$@" -- accel:: labels:: denoise::
