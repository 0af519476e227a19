#!/usr/bin/env bash
# One-machine Slurm "cluster" with N virtual nodes, entirely inside one private
# directory: own munged (own key, own socket), own slurmctld, N slurmd (-N nodeX,
# one port each).  Loopback only.  Every daemon is stopped by the pid we started.
#
#   mini-slurm.sh up [DIR] [NODES] [CPUS_PER_NODE]
#   mini-slurm.sh down [DIR]
#   mini-slurm.sh node-kill DIR nodeK   (SIGKILL that slurmd, and its job steps: "power cut")
#   mini-slurm.sh node-start DIR nodeK
#   mini-slurm.sh env DIR               (prints: export SLURM_CONF=...)
#
# Debian 12 packages: slurm-wlm munge   (22.05.8).  Root not required: SlurmUser = SlurmdUser = caller.
set -euo pipefail
cmd=${1:?up|down|node-kill|node-start|env}; D=${2:?the private directory}
BASEPORT=${MINI_SLURM_PORT:-16817}

start_daemon() { # name, command... : runs in the foreground under setsid, records OUR child's pid
  local name=$1; shift
  setsid "$@" >"$D/log/$name.stdio" 2>&1 </dev/null &
  echo $! >"$D/pid/$name"
}
stop_daemon() { # name [signal]
  local f="$D/pid/$1" sig=${2:-TERM} p
  [ -f "$f" ] || return 0
  p=$(cat "$f"); rm -f "$f"
  kill -0 "$p" 2>/dev/null || return 0
  kill -"$sig" "$p" 2>/dev/null || true
  for _ in $(seq 100); do kill -0 "$p" 2>/dev/null || return 0; sleep 0.1; done
  kill -KILL "$p" 2>/dev/null || true
}
wait_for() { local what=$1; shift; for _ in $(seq 150); do "$@" >/dev/null 2>&1 && return 0; sleep 0.1; done
  echo "mini-slurm: $what did not come up; see $D/log" >&2; return 1; }

case $cmd in
up)
  N=${3:-2}; C=${4:-1}
  mkdir -p "$D"/{log,pid,state,munge}; chmod 0755 "$D"; chmod 0700 "$D/munge"
  D=$(realpath "$D"); U=$(id -un); H=$(hostname -s)
  [ -f "$D/munge/key" ] || { (umask 077; head -c 128 /dev/urandom >"$D/munge/key"); }
  # the socket's directory must be world-traversable; the key's must be 0700 and ours
  mkdir -p "$D/msock"; chmod 0755 "$D/msock"
  cat >"$D/slurm.conf" <<CONF
ClusterName=mini
SlurmctldHost=$H(127.0.0.1)
SlurmctldPort=$BASEPORT
SlurmUser=$U
SlurmdUser=$U
AuthType=auth/munge
AuthInfo=socket=$D/msock/munge.sock,cred_expire=5
CredType=cred/munge
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
StateSaveLocation=$D/state
SlurmdSpoolDir=$D/spool.%n
SlurmctldPidFile=$D/slurmctld.selfpid
SlurmdPidFile=$D/slurmd.%n.selfpid
SlurmctldLogFile=$D/log/slurmctld.log
SlurmdLogFile=$D/log/slurmd.%n.log
SlurmctldDebug=verbose
SlurmdDebug=verbose
# no cgroups, no affinity, no accounting daemon
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/filetxt
JobCompLoc=$D/jobcomp.log
SwitchType=switch/none
MpiDefault=none
MailProg=/bin/true
# scheduling
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,sched_interval=2,bf_interval=2
MaxArraySize=100001
MaxJobCount=200000
MinJobAge=86400
# failure handling
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=10
KillWait=5
OverTimeLimit=0
JobRequeue=1
# virtual nodes: same host, different ports; config_overrides = trust the CPUs= below
SlurmdParameters=config_overrides
NodeName=node[1-$N] NodeHostname=$H NodeAddr=127.0.0.1 Port=[$((BASEPORT+101))-$((BASEPORT+100+N))] CPUs=$C RealMemory=2000 State=UNKNOWN
PartitionName=render Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
  start_daemon munged munged --foreground --key-file="$D/munge/key" --socket="$D/msock/munge.sock" \
     --pid-file="$D/munge/pid" --log-file="$D/munge/log" --seed-file="$D/munge/seed" --num-threads=2
  wait_for munged munge -n --socket="$D/msock/munge.sock"
  export SLURM_CONF=$D/slurm.conf
  start_daemon slurmctld slurmctld -D -f "$SLURM_CONF"
  wait_for slurmctld scontrol ping
  for i in $(seq "$N"); do
    mkdir -p "$D/spool.node$i"
    start_daemon "slurmd.node$i" slurmd -D -N "node$i" -f "$SLURM_CONF"
  done
  wait_for slurmds bash -c "[ \$(sinfo -h -N -t idle -o %N | wc -l) = $N ]"
  echo "export SLURM_CONF=$SLURM_CONF" ;;
down)
  export SLURM_CONF=$D/slurm.conf
  scancel -u "$(id -un)" 2>/dev/null || true
  for _ in $(seq 50); do [ -z "$(squeue -h 2>/dev/null)" ] && break; sleep 0.2; done
  for f in "$D"/pid/slurmd.*; do [ -e "$f" ] && stop_daemon "$(basename "$f")"; done
  stop_daemon slurmctld; stop_daemon munged
  left=$(ls "$D/pid" 2>/dev/null | wc -l); echo "stopped; pid files left: $left" ;;
node-kill)
  n=${3:?node}; d=$(cat "$D/pid/slurmd.$n")
  # this node's slurmstepds: owners of the listening sockets in OUR spool directory (no process names)
  mapfile -t kids < <(ss -xlpH | grep -F " $(realpath "$D/spool.$n")/" | grep -oE 'pid=[0-9]+' | cut -d= -f2)
  kill -KILL "$d"; rm -f "$D/pid/slurmd.$n"
  desc() { local k; for k in $(cat /proc/$1/task/*/children 2>/dev/null); do desc "$k"; done; echo "$1"; }
  for k in "${kids[@]:-}"; do [ -n "$k" ] && for x in $(desc "$k"); do kill -KILL "$x" 2>/dev/null || true; done; done
  echo "killed slurmd $d and stepds: ${kids[*]:-none}" ;;
node-start)
  n=${3:?node}; start_daemon "slurmd.$n" slurmd -D -N "$n" -f "$D/slurm.conf"; echo "started $n pid $(cat "$D/pid/slurmd.$n")" ;;
env) echo "export SLURM_CONF=$D/slurm.conf" ;;
esac
