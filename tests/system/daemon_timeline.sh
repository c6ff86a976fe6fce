#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A timeline of faults in real time: the VIO stops in the air for good, and the daemon lands; the bench says what was
# kept, and its exit code too.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"

# The bench alone stands on the ground: one expectation is kept, the other is not.
printf "after = 'start'\n[[expect]]\nwhat = 'landed'\nat = 1\n" >"$work/kept.toml"
printf "after = 'start'\n[[expect]]\nwhat = 'airborne'\nat = 1\n" >"$work/broken.toml"
alone=("$build/services/backwash-bench" --map builtin:parallel-walls-4m --start -2,0,1.2 --link "$work/alone" --duration 2
  --domain "$domain")
"${alone[@]}" --faults "$work/kept.toml" 2>>"$log" | grep -q '^landed .* pass$' || die "what was kept did not pass"
status=0
"${alone[@]}" --faults "$work/broken.toml" >"$work/table" 2>>"$log" || status=$?
[[ $status == 1 ]] || die "exit code $status instead of 1"
grep -q '^airborne .* FAIL$' "$work/table" || die "what was not kept did not fail"

cat >"$work/timeline.toml" <<'TOML'
[[fault]]
channel = "odometry"
kind = "off"
from = 6.0
until = 100.0
[[expect]]
what = "airborne"
at = 5.5
[[expect]]
what = "landed"
at = 14.0
[[expect]]
what = "moved"
at_most = 0.5
[[expect]]
what = "clearance"
at_least = 0.0
TOML
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --faults "$work/timeline.toml"
start_daemon builtin:quad-5in "$work/log.bwlog"
enable
ctl takeoff --height 1.2 --wait
sleep 15
kill -TERM "$bench_pid"
status=0
wait "$bench_pid" || status=$?
grep -A 4 '^expected' "$log"
[[ $status == 0 ]] || die "the bench says $status"
grep -q 'fault odometry off begins' "$log" || die "the fault is not in the log"
