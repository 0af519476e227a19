#!/bin/sh
# Fuzzes targets one after the other for SECONDS each: sh fuzz/run.sh 180 scene png …; all targets if none is named.
# Finds are written to fuzz/finds/TARGET-* and make the exit code 1. Inputs that reach new code are minimised and kept in
# fuzz/learnt/TARGET, where the next run starts. Git ignores both folders: copy a mended find to fuzz/corpus/TARGET.
set -eu
cd "$(dirname "$0")"
known=$(sed -n 's/^    ("\([a-z]*\)", [a-z]*),$/\1/p' src/targets.rs)
usage() {
    echo "$1: sh fuzz/run.sh SECONDS [TARGET…], targets:" $known >&2
    exit 2
}
[ $# -gt 0 ] || usage "no seconds"
seconds=$1
shift
case $seconds in '' | *[!0-9]*) usage "no number of seconds: $seconds" ;; esac
for target; do
    echo "$known" | grep -qx -e "$target" || usage "no target: $target"
done
[ $# -gt 0 ] || set -- $known
# Coverage on a stable compiler: RUSTC_BOOTSTRAP permits the flags of LLVM's pass.
export RUSTC_BOOTSTRAP=1
export RUSTFLAGS="-Ctarget-cpu=x86-64-v3 --cfg fuzzing -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
-Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares"
cargo build --release --target x86_64-unknown-linux-gnu
mkdir -p finds
# Runs the fuzzer of the target with the limits that all share.
fuzz() {
    FUZZ=$target target/x86_64-unknown-linux-gnu/release/furrow-fuzz -timeout=20 -rss_limit_mb=4096 -max_len=65536 \
        -artifact_prefix="finds/$target-" "$@" 2>&1
}
# Reduces the kept inputs to those that add coverage to the corpus. Keeps all of them if that fails.
minimise() {
    rm -rf "learnt/$target.least"
    mkdir "learnt/$target.least"
    if fuzz -merge=1 "learnt/$target.least" "learnt/$target" "corpus/$target" >"learnt/$target.merge.log"; then
        rm -rf "learnt/$target"
        mv "learnt/$target.least" "learnt/$target"
    else
        rm -rf "learnt/$target.least"
        echo "$target: not minimised, see fuzz/learnt/$target.merge.log"
    fi
}
for target; do
    mkdir -p "learnt/$target"
    echo "$target"
    fuzz -max_total_time="$seconds" -print_final_stats=1 "learnt/$target" "corpus/$target" |
        tee "learnt/$target.log" | grep -E '^(stat::|SUMMARY|Done|#.*(INITED|DONE))' || true
    minimise
done
found=$(for target; do find finds -name "$target-*"; done)
[ -z "$found" ] || { echo "found:" $found; exit 1; }
