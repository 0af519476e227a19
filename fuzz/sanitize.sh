#!/bin/sh
# AddressSanitizer over what is unsafe, the bindings of Embree in crates/embree and of Open Image Denoise in crates/output/src/denoise/oidn: the tests that go through it, built with it: sh fuzz/sanitize.sh
set -eu
cd "$(dirname "$0")/.."
# The sanitizer comes with the stable compiler; its flag is asked for by name. Embree's worker threads are never joined, so leaks are not told;
# a C++ library (tinyexr, within FLIP's) holds a symbol twice, which ends every program before it begins, so that is not told either.
export RUSTC_BOOTSTRAP=1
export RUSTFLAGS="-Ctarget-cpu=x86-64-v3 -Zsanitizer=address"
export ASAN_OPTIONS="detect_leaks=0:detect_odr_violation=0:detect_stack_use_after_return=1"
cargo test --target x86_64-unknown-linux-gnu --target-dir fuzz/target/asan --features system-tests --test all "$@" -- accel:: labels:: denoise::
