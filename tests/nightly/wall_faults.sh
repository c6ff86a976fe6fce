#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# More rows of docs/faults.md on the wall clock, with real processes, than ./check has time for. Judged from the raw
# log and from the bytes that the flight controller received.
#   wall_faults.sh SOURCE_DIR BUILD_DIR [nan] [jump] [unplug] [pause] [disk]        no fault named: all of them
# nan     row 2   broken samples among good ones are refused; alone: HOLD, LAND, QUIET as if the VIO had stopped
# jump    row 3   a pose far away: HOLD in the tick that sees it
# unplug  row 17  the serial line is gone: QUIET in the next tick; a new one resumes nothing
# pause   row 32  the daemon is stopped for a second: QUIET in its first tick, and nothing after
# disk    row 35  the log's directory is gone: the flight goes on, the losses are counted
set -euo pipefail
source_dir=$1 build=$2
shift 2
[[ $# -gt 0 ]] || set -- nan jump unplug pause disk
if [[ $# -gt 1 ]]; then
  failed=0
  for fault; do "$0" "$source_dir" "$build" "$fault" || { echo "$fault: FAILED" >&2; failed=1; }; done
  exit "$failed"
fi
fault=$1
source "$source_dir/services/bench/session.sh"
mkdir "$work/logs"
options=(--log "$work/truth.csv" --wire "$work/wire.csv")
[[ $fault == nan ]] && options+=(--stop-odometry 7)
bench() { start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${options[@]}"; }
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }
now() { python3 -c 'import time; print(time.monotonic())'; }

bench
topic=rt/backwash/odometry
if [[ $fault == nan || $fault == jump ]]; then # through the one writer that the daemon listens to
  "$build/tests/dds_probe" "$domain" backwash "$fault" >>"$log" 2>&1 &
  relay=$! more_pids+=($!)
  topic=rt/relay/odometry
fi
start_daemon builtin:quad-5in "$work/logs/flight.bwlog" "$topic"
enable
ctl takeoff --height 1.2 --wait
[[ $fault == disk ]] || ctl goto 2,0,1.2
at=$(now)
case $fault in
  nan) kill -USR1 "$relay"; wait "$relay"; status ;;
  jump) sleep 1; kill -USR1 "$relay"; wait "$relay"; sleep 3 ;;
  unplug)
    sleep 1
    kill -KILL "$bench_pid"
    wait "$bench_pid" 2>/dev/null || true
    sleep 1
    rm -f "$work/autopilot"
    options=()
    bench
    sleep 3
    ;;
  pause)
    sleep 1
    kill -STOP "$daemon_pid"
    sleep 1
    at=$(now)
    kill -CONT "$daemon_pid"
    sleep 3
    ;;
  disk)
    rm -r "$work/logs"
    ctl goto 2,0,1.2 --wait
    status
    mkdir "$work/logs"
    sleep 2
    ;;
esac
stop

PYTHONPATH=$source_dir/tests/system python3 - "$work" "$fault" "$at" <<'PYTHON'
import json, math, struct, sys
import raw_log
work, fault, at = sys.argv[1], sys.argv[2], float(sys.argv[3])
log = work + "/logs/flight.bwlog"
if fault == "disk":
    status = json.load(open(work + "/status.json"))
    wire = [t for t, i, _ in raw_log.wire(work + "/wire.csv") if i == raw_log.SETPOINT and t > at]
    gap = max(b - a for a, b in zip(wire, wire[1:]))
    said = [line for line in open(work + "/log") if "flight.bwlog" in line]
    print(f"disk: at the goal {status['setpoint']}, {status['records_lost']} records lost, largest gap {gap * 1e3:.1f} ms")
    assert math.dist(status["setpoint"], [2, 0, 1.2]) < 0.01 and status["state"] == "tracking", status
    assert status["records_lost"] > 100, status
    assert gap < 0.060 + 0.020 * status["ticks_missed"], gap
    assert any("is gone" in line for line in said) and any("written again" in line for line in said), said
    sys.exit()
records = list(raw_log.records(log))
ticks = list(raw_log.ticks(log))
poses = [(t, struct.unpack_from("<q3d", body)[1:]) for t, kind, body in records if kind == raw_log.ODOMETRY]
sent = [(t, raw_log.message_id(body)) for t, kind, body in records if kind == raw_log.FRAME_OUT]
first = lambda mode, after: next(t for t in ticks if t.mode == mode and t.t > after)
missed = max(t.missed for t in ticks if t.t > at - 1.5) * 0.020
if fault == "nan":
    refused = json.load(open(work + "/status.json"))["odometry_refused"]
    last = max(t for t, _ in poses)
    hold, land, quiet = first("hold", at), first("land", last), first("quiet", last)
    print(f"nan: {refused} broken samples, {sum(at < t for t, _ in poses)} good ones among them; last good one "
          f"+{(hold.t - last) * 1e3:.0f} ms hold, +{(land.t - last) * 1e3:.0f} ms land, +{(quiet.t - last) * 1e3:.0f} ms quiet")
    assert refused > 500 and last > at + 1 and all(math.isfinite(v) for _, p in poses for v in p)
    assert last < hold.t <= last + 0.100 + missed and land.t - last <= 0.400 + missed
    assert not [t for t, _ in sent if t > quiet.t + 0.001], "frames after QUIET"
elif fault == "jump":
    jump = next(t for t, p in poses if p[0] > 10)
    hold = first("hold", at)
    print(f"jump: +{(hold.t - jump) * 1e3:.1f} ms hold")
    assert 0 <= hold.t - jump <= 0.020 + missed + 0.005
    assert all(abs(p[0]) < 10 for p in [struct.unpack_from("<3f", b, 10 + 4) for _, k, b in records
                                        if k == raw_log.FRAME_OUT and raw_log.message_id(b) == raw_log.SETPOINT])
elif fault == "unplug":
    kill = max(t for t, kind, _ in records if kind == raw_log.FRAME_IN and t < at + 1.6)
    quiet = first("quiet", at)
    print(f"unplug: last frame +{(quiet.t - kill) * 1e3:.0f} ms quiet")
    assert 0 <= quiet.t - kill <= 0.060 + missed
    assert not [i for t, i in sent if t > quiet.t + 0.001 and i == raw_log.SETPOINT], "set-points after the line was lost"
    assert {t.mode for t in ticks if t.t > quiet.t} <= {"quiet", "passive"}, "it resumed by itself"
    again = [t for t, kind, _ in records if kind == raw_log.FRAME_IN and t > quiet.t]
    assert len(again) > 50, "the new line was not opened"
else:
    woken = next(t for t in ticks if t.t > at)
    print(f"pause: {woken.missed} periods missed, {woken.mode} in the first tick after")
    assert woken.missed >= 25 and woken.mode == "quiet", woken
    assert not [t for t, _ in sent if t > woken.t + 0.001], "frames after QUIET"
    assert not [t for t, i, _ in raw_log.wire(work + "/wire.csv") if t > woken.t + 0.02], "frames arrived"
PYTHON
