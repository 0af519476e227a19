#!/bin/bash
# Renders the dataset in @DIR@
# in @SHARDS@ shards, several at once, on this machine or on several that share the folder; then finishes and verifies it.
#
#   bash render.sh
#   JOBS=4 THREADS=2 bash render.sh             four shards at once, two threads each
#   HOSTS=node1,node2 bash render.sh            JOBS shards on each of these, by ssh without a password (GNU parallel only)
#
# Stopped with Ctrl-C, TERM, HUP or USR1 it exits with 75; run it again, and it goes on with what is missing. What is done is read off
# the dataset itself, so GNU parallel's own --resume has no place here.
#
# Written by `trace dataset emit`, and yours to edit.

trace=@TRACE@
dir=@DIR_QUOTED@
shards=@SHARDS@
threads=${THREADS:-@CPUS@}
jobs=${JOBS:-$(($(nproc) / threads))}
[ "$jobs" -gt 0 ] || jobs=1

# Runs a command in a session of its own, hands signals on to everyone in it, waits for all of them, returns the command's exit
# code. Not a process group: GNU parallel gives each of its jobs one.
asked="" child=""
hand_on() {
    asked=$asked$1,
    [ -z "$child" ] || kill -s "$1" $(ps -o pid= -s "$child") 2>/dev/null
}
# USR1: finish the images under way. TERM: stop at once.
trap 'hand_on TERM' INT TERM
trap 'hand_on USR1' USR1 HUP
run() {
    setsid "$@" &
    child=$!
    # `wait` returns whenever a signal is trapped: then the command is waited for again.
    local last=none
    while [ "$last" != "$asked" ]; do
        last=$asked
        wait "$child"
        code=$?
    done
    # xargs may end before the shards that it started.
    while [ -n "$(ps -o pid= -s "$child")" ]; do sleep 0.1; done
    child=
    return "$code"
}

if parallel --version 2>/dev/null | grep -q "GNU parallel"; then
    # The first shard that fails lets those under way go on and starts no other.
    run parallel --will-cite --quote --tag --line-buffer --jobs "$jobs" --halt soon,fail=1 ${HOSTS:+--sshlogin "$HOSTS"} \
        "$trace" dataset render "$dir" --threads "$threads" --shard "{}/$shards"@RENDERING@ ::: $(seq 0 $((shards - 1)))
elif [ -n "${HOSTS:-}" ]; then
    echo "HOSTS needs GNU parallel: install it, or run this script without HOSTS" >&2
    exit 2
else
    # xargs starts no other at 255. It must not be ended by the signals that are meant for the program; the program watches for
    # them although they are ignored here.
    run env --ignore-signal=USR1,TERM xargs -a <(seq 0 $((shards - 1))) -P "$jobs" -I{} \
        bash -c '"$@" || { code=$?; echo "shard ended with $code" >&2; exit 255; }' \
        bash "$trace" dataset render "$dir" --threads "$threads" --shard "{}/$shards"@RENDERING@
fi
code=$?
if [ -n "$asked" ]; then
    echo "stopped; run it again to go on" >&2
    exit 75
fi
[ "$code" = 0 ] || exit "$code"

run "$trace" dataset finish "$dir"@PUSH@ && run "$trace" dataset verify "$dir" --rerender @AGAIN@
code=$?
[ -z "$asked" ] || exit 75
exit "$code"
