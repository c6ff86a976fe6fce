#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# SIGTERM in every state: not a byte on the wire more than a tick later, the process gone within 2 s with exit code 0, its raw
# log whole. Also while a world is being built or a plan made, which may take minutes.
#   daemon_stop.sh SOURCE_DIR BUILD_DIR [MAP START]     with a map: only while its world is built
set -euo pipefail
source_dir=$1 build=$2 map=${3:-builtin:apartment}
source "$source_dir/services/bench/session.sh"
now_ms() { date +%s%3N; }

# stop_daemon STATE: ends it and says how long that took.
stop_daemon() {
  local begun=$(now_ms) code=0 took
  kill -TERM "$daemon_pid"
  wait "$daemon_pid" || code=$?
  took=$(($(now_ms) - begun))
  daemon_pid=''
  echo "$1: gone after $took ms$(tail -n 1 "$log" | grep -o ', with a thread.*' || true)"
  echo "$begun" >>"$work/stops"
  [[ $code -eq 0 ]] || die "$1: exit code $code"
  [[ $took -lt 2000 ]] || die "$1: gone after $took ms"
  tail -n 3 "$log" | grep -q 'stopped' || die "$1: it has not said that it stopped"
}
# begin: a daemon that has said that it runs.
begin() {
  local from=$(wc -l <"$log")
  "$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
  daemon_pid=$!
  for _ in $(seq 200); do
    tail -n +"$((from + 1))" "$log" | grep -q 'backwashd runs' && return
    sleep 0.05
  done
  die "the daemon does not run"
}

bin=$build/services
device=$work/nowhere write_configuration builtin:quad-5in "$work/flight.bwlog"
begin
stop_daemon "waiting for its port"

start_bench "$build/services" "$log" "$map" "${4:-3.0,4.2,1.2}" builtin:quad-5in --wire "$work/wire.csv" --duration 600
write_configuration builtin:quad-5in "$work/flight.bwlog"
begin
stop_daemon "just started"
for wait in 0.1 0.3 0.6 1.0 1.5; do
  begin
  sleep "$wait"
  ! tail -n 3 "$log" | grep -q 'map accepted' || break
  stop_daemon "$wait s into its world"
done
[[ -z $daemon_pid ]] || stop_daemon "with its world"
[[ -z ${3:-} ]] || exit 0 # another map: that much

start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
stop_daemon "enabled, on the ground"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$bin/backwashctl" --domain "$domain" goto 7.4,3.0,1.2 >>"$log" 2>&1 || die "goto was refused"
stop_daemon "planning in flight"
stop
# Nothing of ours on the wire later than three ticks after the last signal (the bench's clock is the station's).
last=$(tail -n 1 "$work/stops")
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$last" <<'PYTHON'
import sys, time
import raw_log
work, last = sys.argv[1], int(sys.argv[2]) * 1e-3
asked = last - (time.time() - time.monotonic())
wire = [t for t, *_ in raw_log.wire(work + "/wire.csv")]
late = [t for t in wire if t > asked + 0.060]
assert len(wire) > 100, len(wire)
assert not late, (len(late), late[0] - asked, late[-1] - asked)
print(f"{len(wire)} frames on the wire, the last {1e3 * (max(wire) - asked):.0f} ms after the signal")
PYTHON
