#!/bin/sh
# Fuzzes targets one after the other, so many seconds each: sh fuzz/run.sh 180 scene png …; all of them without names.
# What libFuzzer finds lies in fuzz/finds/TARGET-*; what it has learnt in fuzz/learnt/TARGET, which is not kept.
set -eu
cd "$(dirname "$0")"
seconds=$1
shift
# Coverage on a stable compiler: the pass is LLVM's, and its flags are asked for by name.
export RUSTC_BOOTSTRAP=1
export RUSTFLAGS="-Ctarget-cpu=x86-64-v3 --cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares"
cargo build --release --target x86_64-unknown-linux-gnu
[ $# -gt 0 ] || set -- scene species experiment png hdr exr glb obj coco rle phenobench record dataset model safetensors
mkdir -p finds
for target; do
    mkdir -p "learnt/$target"
    FUZZ=$target target/x86_64-unknown-linux-gnu/release/furrow-fuzz -max_total_time="$seconds" -timeout=20 -rss_limit_mb=4096 \
        -max_len=65536 -print_final_stats=1 -artifact_prefix="finds/$target-" "learnt/$target" "corpus/$target" 2>&1 |
        tee "learnt/$target.log" | grep -E '^(stat::|SUMMARY|Done|#.*(INITED|DONE))' || true
done
