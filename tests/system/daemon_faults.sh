#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Faults in flight, with real processes: VIO stops, the controller's heartbeat stops, the daemon is killed
# (docs/faults.md rows 1, 21, 36). Judged from the raw log and from the bytes on the wire.
#   daemon_faults.sh SOURCE_DIR BUILD_DIR vio|heartbeat|kill
set -euo pipefail
source_dir=$1 build=$2 fault=$3
source "$source_dir/services/bench/session.sh"
options=(--log "$work/truth.csv" --wire "$work/wire.csv")
# The fault comes on the way: the flight takes 4 s up and about 6 s along.
[[ $fault == vio ]] && options+=(--stop-odometry 6.5)
[[ $fault == heartbeat ]] && options+=(--stop-heartbeat 6.5)
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${options[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2
if [[ $fault == kill ]]; then
  sleep 1.5
  kill -KILL "$daemon_pid"
  killed=$(python3 -c 'import time; print(time.monotonic())')
  wait "$daemon_pid" 2>/dev/null || true
  sleep 0.2
  cp "$work/flight.bwlog" "$work/killed.bwlog"
  start_daemon builtin:quad-5in "$work/flight.bwlog" # the same configuration, as a watchdog starts it
fi
sleep 8
if [[ $fault == kill ]]; then
  enabled=$(python3 -c 'import time; print(time.monotonic())')
  enable
  sleep 0.5
fi
stop
[[ $fault != kill ]] || cmp "$work/flight.bwlog" "$work/killed.bwlog" || die 'the restart touched the last log'

PYTHONPATH=$source_dir/tests/system python3 - "$work" "$fault" "${killed:-0}" "${enabled:-0}" <<'PYTHON'
import csv, sys
import raw_log
work, fault, killed, enabled = sys.argv[1], sys.argv[2], float(sys.argv[3]), float(sys.argv[4])
# Odometry and answers of the clock are a sensor's, and go on; whatever else is sent commands, or keeps a failsafe from acting.
wire = [row for row in raw_log.wire(work + "/wire.csv") if row[1] not in (raw_log.ODOMETRY_FRAME, raw_log.TIMESYNC)]
truth = list(csv.DictReader(open(work + "/truth.csv")))
landed = [float(r["t_s"]) for r in truth if r["armed"] == "0" and float(r["t_s"]) > wire[0][0] + 5]
assert landed, "the vehicle did not end on the ground"
log = work + "/flight.bwlog"
ticks = list(raw_log.ticks(log))
first = lambda mode, after=0: next(t for t in ticks if t.mode == mode and t.t > after)
missed = max(t.missed for t in ticks if t.mode != "passive") * 0.020  # what a stolen processor took from the daemon

if fault == "vio":
    last = max(raw_log.times(log, raw_log.ODOMETRY))
    hold, land, quiet = first("hold", last - 1), first("land", last), first("quiet", last)
    print(f"last odometry +{(hold.t - last) * 1e3:.0f} ms hold, +{(land.t - last) * 1e3:.0f} ms land, "
          f"+{(quiet.t - last) * 1e3:.0f} ms quiet")
    assert hold.t - last <= 0.100 + missed and land.t - last <= 0.400 + missed
    # While holding, the same position goes out; it is the last one sent before.
    rows = [r for r in csv.DictReader(open(work + "/wire.csv")) if r["id"] == str(raw_log.SETPOINT)]
    held = {(r["x"], r["y"], r["z"]) for r in rows if hold.t + 0.005 < float(r["t_s"]) < land.t}
    assert len(held) == 1, held
    assert any(i == raw_log.COMMAND and land.t - 0.01 < t < quiet.t for t, i, _ in wire), "land was not asked for"
    assert not [t for t, i, _ in wire if i == raw_log.SETPOINT and t > land.t + 0.02], "set-points after LAND"
    assert not [t for t, i, _ in wire if t > quiet.t + 0.02], "frames after QUIET"
elif fault == "heartbeat":
    last = max(raw_log.times(log, raw_log.FRAME_IN, raw_log.HEARTBEAT))
    quiet = first("quiet", last)
    print(f"last heartbeat +{(quiet.t - last) * 1e3:.0f} ms quiet")
    assert 1.5 <= quiet.t - last <= 1.54 + missed
    assert not [t for t, i, _ in wire if t > quiet.t + 0.02], "frames after QUIET"
else:
    armed_after = [float(r["t_s"]) for r in truth if r["armed"] == "1" and float(r["t_s"]) > killed]
    print(f"killed; armed for {armed_after[-1] - killed:.1f} s more, "
          f"{sum(t > killed + 0.05 for t, _, _ in wire)} frames since")
    assert armed_after[-1] - killed > 1, "the vehicle was not in the air"
    assert not [t for t, i, _ in wire if killed + 0.05 < t < armed_after[-1] - 0.1], "frames to an armed vehicle after the restart"
    second = list(raw_log.ticks(work + "/flight-2.bwlog"))
    assert {t.mode for t in second if t.t < enabled} == {"passive"}, "the restarted daemon took control by itself"
    assert not [t for t, i, _ in wire if i == raw_log.SETPOINT and killed + 0.05 < t < enabled]
    assert [t for t, i, _ in wire if i == raw_log.SETPOINT and t > enabled], "an operator cannot enable it again"
PYTHON
