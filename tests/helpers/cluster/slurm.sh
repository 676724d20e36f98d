#!/usr/bin/env bash
# A Slurm of one node on this machine, for tests: `slurm.sh start FOLDER`, `slurm.sh stop FOLDER`.
# Controller, node and authentication listen on the loopback interface alone; all their files are in FOLDER.
# Needs root and the Debian packages slurmctld, slurmd, slurm-client and munge.
set -euo pipefail
action=$1
folder=$(realpath "$2")
node=$(hostname -s)
processors=2 # that the node says it has
configuration=swesbi-test-slurm.conf # in the folder; by its name what a killed test left is known
system=/etc/slurm/slurm.conf # where commands inside a job look, to which no variable of the submitting shell comes

write_configuration() {
    cat >"$folder/$configuration" <<CONF
ClusterName=test
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=16817
SlurmdPort=16818
CommunicationParameters=NoCtldInAddrAny,NoInAddrAny
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SlurmdParameters=config_overrides
MpiDefault=none
MinJobAge=3600
ReturnToService=2
NodeName=$node NodeAddr=127.0.0.1 CPUs=$processors RealMemory=$(($(awk '/MemTotal/ {print $2}' /proc/meminfo) / 1024 - 512)) State=UNKNOWN
PartitionName=main Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
}

is_left_over() {
    [ "$(basename "$(readlink "$system")")" = "$configuration" ] && ! pgrep -x slurmctld >/dev/null
}

start() {
    mkdir -p "$folder/state" "$folder/spool"
    chmod 755 "$folder"
    head -c 1024 /dev/urandom >"$folder/munge.key"
    chmod 600 "$folder/munge.key"
    munged --force --num-threads=2 --key-file="$folder/munge.key" --socket="$folder/munge.socket" \
        --pid-file="$folder/munged.pid" --seed-file="$folder/munge.seed" --log-file="$folder/munged.log"
    write_configuration
    if is_left_over; then
        rm "$system"
    fi
    if [ -e "$system" ]; then
        echo "$system exists: this machine has a Slurm of its own" >&2
        exit 1
    fi
    mkdir -p "$(dirname "$system")"
    ln -s "$folder/$configuration" "$system"
    slurmctld
    slurmd
    for _ in $(seq 60); do
        [ "$(sinfo --noheader --format=%T 2>/dev/null)" = idle ] && exit 0
        sleep 0.5
    done
    echo "Slurm did not start:" >&2
    tail -n 5 "$folder"/*.log >&2
    exit 1
}

stop() {
    scancel --user "$(id -un)" || true # what a failed test left would go on writing
    for _ in $(seq 20); do
        [ -z "$(squeue --noheader 2>/dev/null)" ] && break
        sleep 0.5
    done
    for daemon in slurmd slurmctld munged; do
        [ -f "$folder/$daemon.pid" ] && kill "$(cat "$folder/$daemon.pid")" || true
    done
    [ "$(readlink "$system")" = "$folder/$configuration" ] && rm "$system"
}

"$action"
