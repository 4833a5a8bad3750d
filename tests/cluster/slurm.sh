#!/bin/bash
# Runs examples/cluster/slurm_array.sbatch for real, on a Slurm of this machine alone, and compares the merged dataset byte
# by byte with one that was made without shards.
# Usage: tests/cluster/slurm.sh RECIPE [IMAGES]; needs root and the Debian package slurm-wlm
set -eu
recipe=$(realpath "$1") images=${2:-40}
export PETCOMP; PETCOMP=$(realpath "${PETCOMP:-target/release/petcomp}")
script=$(realpath "$(dirname "$0")/../../examples/cluster/slurm_array.sbatch")
for tool in slurmctld slurmd munged sbatch; do
  PATH=$PATH:/usr/sbin command -v "$tool" > /dev/null || { echo "skipped: no $tool (Debian: slurm-wlm)"; exit 0; }
done
[ "$(id -u)" = 0 ] || { echo "skipped: only root may start Slurm's services"; exit 0; }
PATH=$PATH:/usr/sbin
work=$(mktemp -d)
chmod 755 "$work"
host=$(hostname -s)
# Everything below the work folder: no other Slurm on this machine is touched.
export SLURM_CONF=$work/slurm.conf
cat > "$SLURM_CONF" <<CONF
ClusterName=petcomp
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=26817
SlurmdPort=26818
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
CryptoType=crypto/munge
ProctrackType=proctrack/pgid
TaskPlugin=task/none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
MpiDefault=none
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
mkdir "$work/state" "$work/spool"
munge=$work/munge
mkdir -m 700 "$munge"
head -c 1024 /dev/urandom > "$munge/key"
chmod 400 "$munge/key"
pids=()
stop() { for pid in "${pids[@]}"; do kill "$pid" 2> /dev/null || true; done; wait 2> /dev/null || true; rm -rf "$work"; }
trap stop EXIT
munged --foreground --force --num-threads=1 --socket="$work/munge.socket" --key-file="$munge/key" \
  --pid-file="$work/munge.pid" --log-file="$work/munge.log" --seed-file="$munge/seed" 2> /dev/null & pids+=($!)
sleep 1
slurmctld -D -c 2> /dev/null & pids+=($!)
slurmd -D -c -N "$host" 2> /dev/null & pids+=($!)
for _ in $(seq 60); do
  case "$(sinfo -h -o %t 2> /dev/null)" in idle|alloc|mix) break ;; esac
  sleep 1
done
sinfo

set +e
job=$(SHARDS=4 sbatch --parsable --wait --array=1-4 --cpus-per-task=1 --mem=500M -o "$work/task-%a.log" "$script" "$recipe" "$images" "$work/run")
status=$?
set -e
[ "$status" = 0 ] || { echo "the array failed ($status)"; tail "$work"/task-*.log "$work"/slurm*.log; exit 1; }
echo "Slurm array $job:"; ls "$work/run"
"$PETCOMP" -q dataset merge "$work"/run/shard-* -o "$work/merged"
"$PETCOMP" -q dataset generate "$recipe" -n "$images" -o "$work/whole"
diff -r --exclude='.*' "$work/whole" "$work/merged"
echo "$(find "$work/merged" -type f -not -name '.*' | wc -l) files of $images images in 4 tasks: the same bytes as without shards"
