#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Finite numbers that no float holds (docs/faults.md row 43): a velocity of 1e39 m/s. No float in any message is
# infinite or NaN but the rates and covariances of ODOMETRY, and the flight is held as with a broken sample.
#   attack_05_numbers_beyond_float.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
"$build/tests/attacker" "$domain" relay rt/backwash/odometry rt/huge/odometry velocity 1e39 0 >"$work/huge" &
more_pids+=($!)
start_daemon builtin:quad-5in "$work/flight.bwlog" rt/huge/odometry
enable
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2
sleep 5
stop
cat "$work/huge" >>"$log"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import math, struct, sys
import raw_log
work = sys.argv[1]
huge = float(open(work + "/huge").read().split()[0])
log = work + "/flight.bwlog"
# Message: offset and number of its floats; ODOMETRY's rates and covariances, which may be unknown (NaN), left out.
floats = {raw_log.SETPOINT: (4, 11), raw_log.COMMAND: (0, 7), 331: (8, 10)}
sent = bad = 0
for t, kind, body in raw_log.records(log):
    if kind != raw_log.FRAME_OUT or raw_log.message_id(body) not in floats:
        continue
    offset, count = floats[raw_log.message_id(body)]
    payload = body[10:10 + body[1]] + bytes(255)
    values = struct.unpack_from(f"<{count}f", payload, offset)
    sent += 1
    bad += not all(math.isfinite(v) for v in values)
ticks = [t for t in raw_log.ticks(log) if t.t > huge]
missed = max(t.missed for t in ticks) * 0.020
held = next((t.t - huge for t in ticks if t.mode != "tracking"), None)
print(f"{sent} messages with floats, {bad} of them with one that is not finite; held after {held} s")
assert sent > 500 and bad == 0, "a float that is not finite was sent"
assert held is not None and held <= 0.120 + missed, "it flew on such numbers"
PYTHON
