#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A campaign through a real slurmctld and slurmd of this script's own, without systemd: of an array one task is killed with -9, slurmd is
# killed and started again in mid-array, what is missing is submitted again, and the merge is byte for byte the program's own rows.
# The same through GNU parallel.
#   campaign_slurm.sh BACKWASH
# slurmctld asks for an address that is not the loopback's: a network of its own has one, and nobody else's ports.
source "$(dirname "${BASH_SOURCE[0]}")/../support/skip.sh"
export PATH=$PATH:/usr/sbin
if [[ ${2:-} != inside ]]; then
  needs parallel slurmctld slurmd munged sbatch ip
  needs_root
  own_network "$0" "$1" inside
fi
ip address add 10.99.0.1/32 dev lo
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
cp "$here/campaign_rows.py" rows.py
commands() { for seed in 1 2 3 4 5 6 7 8; do echo "./rows.py $seed a $2"; done >"$1.txt"; } # commands NAME SECONDS: of each line
for seed in 1 2 3 4 5 6 7 8; do ./rows.py $seed a; done >alone.jsonl
done_of() { find "$1" -name 'line-*.jsonl' | wc -l; }
# until SECONDS COMMAND…: waits for it to hold
until_() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do ((SECONDS < end)) || { tail -n 20 "$work"/*.log >&2 || true; die "never came true: $*"; }; sleep 0.2; done
}

commands by_parallel 0.2
"$backwash" campaign run by_parallel.txt -o by_parallel 3
seq 8 | parallel -j 2 "$backwash" campaign run by_parallel.txt -o by_parallel 2>parallel.txt || die "GNU parallel: $(cat parallel.txt)"
"$backwash" campaign merge by_parallel.txt -o by_parallel >/dev/null
cmp by_parallel/rows.jsonl alone.jsonl

# Everything of it lies in $work, and listens on ports of its own.
host=$(hostname -s) port=$((20000 + $$ % 20000))
pids=()
end() {
  for pid in "${pids[@]}"; do kill -9 "$pid" 2>/dev/null || true; done
  wait 2>/dev/null
  sleep 0.2
  cd /
  rm -rf "$work"
}
trap end EXIT
chmod 755 "$work"
mkdir state spool munge
dd if=/dev/urandom of=munge/key bs=128 count=1 status=none
chmod 400 munge/key
chmod 755 munge
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/munged.log" --seed-file="$work/munge/seed" >munged.log 2>&1 &
pids+=($!)
cat >slurm.conf <<CONF
ClusterName=backwash
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CryptoType=crypto/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
MpiDefault=none
ReturnToService=2
SlurmdTimeout=60
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=day Nodes=$host Default=YES MaxTime=10 State=UP
CONF
export SLURM_CONF=$work/slurm.conf
until_ 10 test -S munge/socket
slurmctld -D -f "$SLURM_CONF" >>slurmctld.log 2>&1 &
slurmctld=$!
pids+=($slurmctld)
slurmd -D -f "$SLURM_CONF" >>slurmd.log 2>&1 &
slurmd=$!
pids+=($slurmd)
up() { [[ $(sinfo --noheader -o %t 2>/dev/null) == idle* ]]; }
# Where it has ended already, each question would wait for it as long as Slurm does.
for _ in $(seq 100); do
  { up || ! kill -0 $slurmctld 2>/dev/null; } && break
  sleep 0.3
done
until_ 1 up

# A line takes 3 s: two are at work, the first of them is killed; then slurmd is, and comes again.
commands by_slurm 3
"$backwash" campaign submit by_slurm.txt -o by_slurm --partition day --time 2 >submitted.txt
grep -q '^array [0-9]* of 8 lines, merge [0-9]* after it$' submitted.txt || die "$(cat submitted.txt)"
at_work() { pgrep -f "campaign run $work/by_slurm.txt .*--task [0-9]" >task.txt; }
until_ 30 at_work
task=$(head -n 1 task.txt)
line=$(tr '\0' ' ' <"/proc/$task/cmdline" | sed 's/.*--task \([0-9]*\).*/\1/')
kill -9 "$task"
some() { [[ $(done_of by_slurm) -ge 2 ]]; }
until_ 60 some
kill -9 $slurmd
wait $slurmd 2>/dev/null || true
sleep 1
slurmd -D -f "$SLURM_CONF" >>slurmd.log 2>&1 &
pids+=($!)
idle() { [[ -z $(squeue --noheader) ]]; }
until_ 120 idle
[[ $(done_of by_slurm) -lt 8 && ! -e by_slurm/rows.jsonl ]] || die "the killed line $line was not missing"
grep -q "lines .*$line.* are missing" by_slurm/merge.log || die "the merge did not tell: $(cat by_slurm/merge.log)"
missing=$((8 - $(done_of by_slurm)))
"$backwash" campaign submit by_slurm.txt -o by_slurm >submitted.txt
grep -q "of $missing lines" submitted.txt || die "not only the $missing missing ones: $(cat submitted.txt)"
until_ 120 idle
cmp by_slurm/rows.jsonl alone.jsonl
echo "$missing of 8 lines were submitted again; merged, the bytes are the same"
