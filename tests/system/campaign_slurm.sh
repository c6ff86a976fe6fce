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
rows=$here/campaign_rows.py
plan() { # plan NAME SECONDS: eight shards of one row each, which take so long
  cp "$rows" rows.py
  printf 'kind = "program"\nseconds = 60\nshard_seconds = 60\n[program]\ncommand = ["./rows.py", "{seed}", "a", "%s"]\ncount = 8\n' "$2" >"$1.toml"
  "$backwash" campaign plan "$1.toml" -o "$1" >/dev/null
}
for seed in 1 2 3 4 5 6 7 8; do "$rows" $seed a; done >alone.jsonl
done_of() { "$backwash" campaign status "$1" --json | python3 -c 'import json, sys; print(len(json.load(sys.stdin)["done"]))'; }
# until SECONDS COMMAND…: waits for it to hold
until_() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do ((SECONDS < end)) || { tail -n 20 "$work"/*.log >&2 || true; die "never came true: $*"; }; sleep 0.2; done
}

plan by_parallel 0.2
"$backwash" campaign run by_parallel 3
"$backwash" campaign submit by_parallel --parallel -j 2 >/dev/null 2>parallel.txt || die "GNU parallel: $(cat parallel.txt)"
cmp by_parallel/rows.jsonl alone.jsonl
[[ $(wc -l <by_parallel/parallel.log) == 8 ]] || die "seven shards were missing: $(cat by_parallel/parallel.log)"

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

# A shard takes 3 s: two are at work, the first of them is killed; then slurmd is, and comes again.
plan by_slurm 3
"$backwash" campaign submit by_slurm --slurm --partition day --time 2 >submitted.txt
grep -q '^array [0-9]* of 8 shards, merge [0-9]* after it$' submitted.txt || die "$(cat submitted.txt)"
at_work() { "$backwash" campaign status by_slurm --json | grep -q '"running":\[[0-9]'; }
until_ 30 at_work
shard=$("$backwash" campaign status by_slurm --json | python3 -c 'import json, sys; print(json.load(sys.stdin)["running"][0])')
kill -9 "$(pgrep -f "campaign run $work/by_slurm $shard\$" | head -n 1)"
some() { [[ $(done_of by_slurm) -ge 2 ]]; }
until_ 60 some
kill -9 $slurmd
wait $slurmd 2>/dev/null || true
sleep 1
slurmd -D -f "$SLURM_CONF" >>slurmd.log 2>&1 &
pids+=($!)
idle() { [[ -z $(squeue --noheader) ]]; }
until_ 120 idle
[[ $(done_of by_slurm) -lt 8 && ! -e by_slurm/rows.jsonl ]] || die "the killed shard $shard was not missing"
grep -q "shards .*$shard.* of 0-7 are missing" by_slurm/merge.log || die "the merge did not tell: $(cat by_slurm/merge.log)"
missing=$((8 - $(done_of by_slurm)))
"$backwash" campaign submit by_slurm --slurm >submitted.txt
grep -q "of $missing shards" submitted.txt || die "not only the $missing missing ones: $(cat submitted.txt)"
until_ 120 idle
cmp by_slurm/rows.jsonl alone.jsonl
echo "$missing of 8 shards were submitted again; merged, the bytes are the same"
