#!/bin/bash
# Renders the dataset in @DIR@
# in @SHARDS@ shards, several at the same time, on this machine or on several that share the folder; then finishes and verifies it.
#
#   bash render.sh
#   JOBS=4 THREADS=2 bash render.sh             four shards at the same time, two threads each
#   HOSTS=node1,node2 bash render.sh            JOBS shards on each host, by ssh without a password (GNU parallel only)
#
# After Ctrl-C, TERM, HUP or USR1 it exits with 75; run it again to make the missing images. The progress is read from the dataset
# itself, so GNU parallel's own --resume is not needed.
#
# Written by `trace dataset emit`; edit it as needed.

trace=@TRACE@
dir=@DIR_QUOTED@
shards=@SHARDS@
threads=${THREADS:-@CPUS@}
jobs=${JOBS:-$(($(nproc) / threads))}
[ "$jobs" -gt 0 ] || jobs=1

# Runs a command in a separate session, forwards signals to all processes of the session, waits for all of them, and returns the
# command's exit code. A process group would not suffice: GNU parallel gives each of its jobs its own.
asked="" child=""
hand_on() {
    asked=$asked$1,
    [ -z "$child" ] || kill -s "$1" $(ps -o pid= -s "$child") 2>/dev/null
}
# USR1: finish the images in progress. TERM: stop at once.
trap 'hand_on TERM' INT TERM
trap 'hand_on USR1' USR1 HUP
run() {
    setsid "$@" &
    child=$!
    # `wait` returns whenever a signal is trapped; the loop then waits for the command again.
    local last=none
    while [ "$last" != "$asked" ]; do
        last=$asked
        wait "$child"
        code=$?
    done
    # xargs may end before the shards that it has started.
    while [ -n "$(ps -o pid= -s "$child")" ]; do sleep 0.1; done
    child=
    return "$code"
}

if parallel --version 2>/dev/null | grep -q "GNU parallel"; then
    # After the first failed shard, the running shards continue and no further one is started.
    run parallel --will-cite --quote --tag --line-buffer --jobs "$jobs" --halt soon,fail=1 ${HOSTS:+--sshlogin "$HOSTS"} \
        "$trace" dataset render "$dir" --threads "$threads" --shard "{}/$shards"@RENDERING@ ::: $(seq 0 $((shards - 1)))
elif [ -n "${HOSTS:-}" ]; then
    echo "HOSTS needs GNU parallel: install it, or run this script without HOSTS" >&2
    exit 2
else
    # Exit code 255 stops xargs from starting further shards. xargs itself must not be ended by the signals for the program; the
    # program handles them although they are ignored here.
    run env --ignore-signal=USR1,TERM xargs -a <(seq 0 $((shards - 1))) -P "$jobs" -I{} \
        bash -c '"$@" || { code=$?; echo "shard ended with $code" >&2; exit 255; }' \
        bash "$trace" dataset render "$dir" --threads "$threads" --shard "{}/$shards"@RENDERING@
fi
code=$?
if [ -n "$asked" ]; then
    echo "stopped; run it again to continue" >&2
    exit 75
fi
[ "$code" = 0 ] || exit "$code"

run "$trace" dataset finish "$dir"@PUSH@ && run "$trace" dataset verify "$dir" --rerender @AGAIN@
code=$?
[ -z "$asked" ] || exit 75
exit "$code"
