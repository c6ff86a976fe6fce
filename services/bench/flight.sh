#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# One flight as it will fly: backwash-bench (flight controller on a pty, VIO and mapper on DDS), backwashd and backwashctl
# as processes of their own, judged afterwards from the daemon's raw log. Starts and stops everything; leaves nothing running.
#   flight.sh BUILD_DIR OUT_DIR NAME MAP START GOAL [VEHICLE [SEED]]
# Writes OUT_DIR/NAME.{html,bwlog,truth.csv,wire.csv,status.json,log}; exits with the code of `backwash report`.
set -euo pipefail
bin=$1/services out=$(mkdir -p "$2" && cd "$2" && pwd) name=$3 map=$4 start=$5 goal=$6 vehicle=${7:-builtin:quad-5in} seed=${8:-1}
model=$vehicle
# A domain of its own, so that flights on one machine do not hear each other: the port numbers of domains above 200 meet
# those that the system hands out.
domain=${BACKWASH_DOMAIN:-$((1 + $$ % 200))}
work=$(mktemp -d)
log=$out/$name.log
pids=()
stop() {
  for pid in "${pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in "${pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  pids=()
}
trap 'stop; rm -rf "$work"' EXIT
die() { echo "flight: $*; see $log" >&2; exit 70; }

cat >"$work/backwashd.toml" <<TOML
vehicle = "$vehicle"
model = "$model"
[dds]
domain = $domain
interface = "lo"
namespace = "backwash"
odometry_topic = "rt/backwash/odometry"
[link]
device = "$work/autopilot"
baud = 921600
system = 1
[control]
priority = 80
[log]
file = "$out/$name.bwlog"
TOML

: >"$log"
"$bin/backwash-bench" --map "$map" --vehicle "$vehicle" --start "$start" --seed "$seed" --link "$work/autopilot" \
  --domain "$domain" --log "$out/$name.truth.csv" --wire "$out/$name.wire.csv" ${BENCH_ARGS:-} >>"$log" 2>&1 &
pids+=($!)
for _ in $(seq 100); do [[ -e $work/autopilot ]] && break; sleep 0.05; done
[[ -e $work/autopilot ]] || die "the bench did not start"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
pids+=($!)
for _ in $(seq 1200); do grep -q 'map accepted' "$log" && break; sleep 0.1; done
grep -q 'map accepted' "$log" || die "the daemon accepted no map"

ctl() { "$bin/backwashctl" --domain "$domain" "$@" >>"$log" 2>&1 || die "backwashctl $1 failed: $(tail -n 1 "$log")"; }
ctl enable --wait
ctl takeoff --height "${start##*,}" --wait
ctl goto "$goal" --wait
sleep 3  # hold at the goal
"$bin/backwashctl" --domain "$domain" status --json >"$out/$name.status.json" 2>>"$log" || die "no status at the goal"
ctl land --wait
stop
"$bin/backwash" report --log "$out/$name.bwlog" --truth "$out/$name.truth.csv" --vehicle "$vehicle" --model "$model" \
  --out "$out/$name.html" --force
