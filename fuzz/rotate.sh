#!/usr/bin/env bash
# Fuzzes one target after the other for as long as the machine has nothing else to do: bash fuzz/rotate.sh [SECONDS]
# Each turn runs the target with the fewest CPU seconds in fuzz/hours.tsv for SECONDS (default 3600) and adds to its line. The programs
# run in the scheduling class `idle`, and their group of processes has the lowest priority: they get little time that another program
# wants. Ctrl-C ends it; the line of the turn is then not written.
set -euo pipefail
cd "$(dirname "$0")"
seconds=${1:-3600}
# Without this, Linux shares the cores equally between terminals, whatever the class of their programs.
[ ! -w /proc/self/autogroup ] || echo 19 >/proc/self/autogroup
table=hours.tsv
TIMEFORMAT='%U %S'
names=$(sed -n 's/^    ("\([a-z]*\)", [a-z_]*),$/\1/p' src/targets.rs)
column() { awk -F'\t' -v target="$1" -v k="$2" '$1 == target { print $k }' "$table"; }

[ -f "$table" ] || printf 'target\tCPU seconds\texecutions\tcoverage\tfinds\tlast run\n' >"$table"
for target in $names; do
    [ -n "$(column "$target" 1)" ] || printf '%s\t0\t0\t0\t0\tnever\n' "$target" >>"$table"
done
chrt --idle 0 sh run.sh 1 rle >/dev/null # compiles
while :; do
    target=$(tail -n +2 "$table" | sort -t $'\t' -k2,2n | head -1 | cut -f1)
    before=$(find finds -name "$target-*" 2>/dev/null | wc -l)
    exec 3>&1
    cpu=$({ time chrt --idle 0 sh run.sh "$seconds" "$target" >&3 2>&3 || true; } 2>&1)
    exec 3>&-
    finds=$(($(find finds -name "$target-*" | wc -l) - before))
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "learnt/$target.log")
    coverage=$(grep -oE 'cov: [0-9]+' "learnt/$target.log" | tail -1 | cut -d' ' -f2)
    awk -F'\t' -v OFS='\t' -v target="$target" -v cpu="$cpu" -v runs="${executions:-0}" -v cov="${coverage:-0}" -v finds="$finds" \
        -v day="$(date +%F)" 'BEGIN { split(cpu, s, " "); used = int(s[1] + s[2]) }
        $1 == target { $2 += used; $3 += runs; $4 = cov > $4 ? cov : $4; $5 += finds; $6 = day } { print }' "$table" >"$table.new"
    mv "$table.new" "$table"
    [ "$finds" -eq 0 ] || echo "found: fuzz/finds/$target-*; mend it, and copy the file to fuzz/corpus/$target" >&2
done
