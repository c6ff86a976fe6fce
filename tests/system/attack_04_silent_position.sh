#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# LOCAL_POSITION_NED and the attitude stop arriving while the heartbeat goes on (docs/faults.md row 42): HOLD after
# 300 ms, LAND after 1 s; then enabling is refused on the old pose.
#   attack_04_silent_position.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
mv "$work/autopilot" "$work/controller"
"$source_dir/tests/system/line_filter.py" "$(readlink "$work/controller")" "$work/autopilot" silent "$work/silence" >>"$log" 2>&1 &
more_pids+=($!)
for _ in $(seq 100); do [[ -e $work/autopilot ]] && break; sleep 0.05; done
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2
sleep 1
touch "$work/silence"
silent=$(python3 -c 'import time; print(time.monotonic())')
sleep 7
"$bin/backwashctl" --domain "$domain" enable >>"$log" 2>&1 && enabled=1 || enabled=0
sleep 0.5
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$silent" "$enabled" <<'PYTHON'
import sys
import raw_log
work, silent, enabled = sys.argv[1], float(sys.argv[2]), sys.argv[3]
log = work + "/flight.bwlog"
last = max(raw_log.times(log, raw_log.FRAME_IN, 32))
assert silent - 0.2 < last < silent + 3, "positions did not stop"  # how soon is the filter's; what is judged counts from the last
ticks = [t for t in raw_log.ticks(log) if t.t > last]
missed = max(t.missed for t in ticks) * 0.020
heard = max(raw_log.times(log, raw_log.FRAME_IN, raw_log.HEARTBEAT))
first = lambda mode: next((t.t - last for t in ticks if t.mode == mode), None)
print(f"last position +{first('hold')} s hold, +{first('land')} s land; heartbeat until +{heard - last:.1f} s; enabled after: {enabled}")
assert first("hold") is not None and first("hold") <= 0.340 + missed, "its silence was not noticed"
assert first("land") is not None and first("land") <= 1.060 + missed, "it did not land"
assert not [t for t in ticks if t.t > last + 1.1 + missed and t.mode in ("tracking", "enabling")], "it flew on an old pose"
PYTHON
