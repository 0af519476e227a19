#!/usr/bin/env bash
# Everything that must hold before a change is merged: format, lints, documentation, all tests with all features. Installs what the
# tests compare with (tests/peers.sh). Runs in a fresh clone, as root or as a user who may sudo, and asks nothing.
set -euo pipefail
cd "$(dirname "$0")/.."
bash tests/peers.sh build
# A fresh clone compiles everything once: data for later compilations would take a fifth more CPU time and gigabytes of disk. Where
# such data exist, what was compiled with them is used.
[ -d target/debug/incremental ] || export CARGO_INCREMENTAL=0
# Downloads while the processor compiles.
bash tests/peers.sh libtorch & libtorch=$!
bash tests/peers.sh packages python & peers=$!
trap 'kill $libtorch $peers 2>/dev/null || true' EXIT
cargo fmt --check
# Without features, only the crates that have features compile other code. Their tests are checked with all features.
cargo clippy -p furrow -p furrow-cli -p furrow-job -p furrow-render -p furrow-train --no-default-features -- -D warnings
wait $libtorch
cargo clippy --workspace --all-targets --features system-tests,train,raster -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps --features train,raster
wait $peers
FURROW_REQUIRE_PEERS=1 cargo test --workspace --features system-tests,train,raster
