#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A flight through the real processes, judged from the raw log and from the bytes that reached the flight controller.
#   daemon_flight.sh SOURCE_DIR BUILD_DIR NAME MAP START GOAL
set -euo pipefail
source_dir=$1 build=$2 name=$3 map=$4
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
# The most that the daemon held so far, kB.
while sleep 0.5; do
  for daemon in $(pgrep -x backwashd); do
    ! grep -q "FLIGHT_OUT=$out" "/proc/$daemon/environ" || sed -n 's/^VmHWM:[^0-9]*\([0-9]*\) kB/\1/p' "/proc/$daemon/status" >>"$out/held"
  done
done 2>/dev/null &
watch=$!
trap 'kill "$watch" 2>/dev/null || true; rm -rf "$out"' EXIT
FLIGHT_OUT=$out "$source_dir/services/bench/flight.sh" "$build" "$out" "$name" "$map" "$5" "$6" || { cat "$out/$name.log"; exit 1; }
kill "$watch"
pgrep -f "$out" && { echo "something was left running"; exit 1; }

PYTHONPATH=$source_dir/tests/system python3 - "$out/$name" "$out/held" <<'PYTHON'
import csv, json, sys
import raw_log
base = sys.argv[1]
held = max(int(line) for line in open(sys.argv[2])) * 1024e-6
print(f"the daemon held {held:.0f} MB")
assert held < 160, "the daemon holds more than 160 MB"
status = json.load(open(base + ".status.json"))
assert status["state"] == "tracking" and status["samples_outside"] == 0 and status["records_lost"] == 0, status
assert status["frames_bad"] == 0 and status["odometry_rejected"] == 0 and status["maps_rejected"] == 0, status
assert status["frame_residual_m"] < 0.05 and status["frame_residual_rad"] < 0.0524, status
assert status["samples_inside"] > 400, status

ticks = list(raw_log.ticks(base + ".bwlog"))
flying = [t for t in ticks if t.mode == "tracking"]
assert all(a.number + 1 == b.number for a, b in zip(ticks, ticks[1:])), "a tick is missing from the raw log"
# What was sent, as the flight controller saw it: each in its order, and of set-points every field used but the yaw rate. When: by the
# daemon's own clock, since what lies between, a pseudo-terminal and the bench, are processes like any other. 50 Hz from when it was
# enabled on, no gap beyond 2 ticks more than the daemon itself knows to have missed.
wire = list(csv.DictReader(open(base + ".wire.csv")))
def sent(message):
    frames = [(t, body[4]) for t, kind, body in raw_log.records(base + ".bwlog") if kind == raw_log.FRAME_OUT and raw_log.message_id(body) == message]
    arrived = [int(row["sequence"]) for row in wire if row["id"] == str(message)]
    assert arrived == [number for _, number in frames[:len(arrived)]] and len(frames) - len(arrived) <= 1, message # both end at once
    return [t for t, _ in frames]
masks = {row["type_mask"] for row in wire if row["id"] == str(raw_log.SETPOINT)}
assert masks == {str(0x800)}, masks
begun = max(t.t for t in ticks if t.mode == "passive" and t.t < flying[0].t)
setpoints = [t for t in sent(raw_log.SETPOINT) if t > begun]
gaps = sorted(b - a for a, b in zip(setpoints, setpoints[1:]))
rate = (len(setpoints) - 1) / (setpoints[-1] - setpoints[0])
missed = max(t.missed for t in flying)
late = [t.lateness_us for t in flying]
print(f"set-points {len(setpoints)}, {rate:.2f} Hz, largest gap {gaps[-1] * 1e3:.1f} ms, missed periods {missed}")
compute = sorted(t.compute_us for t in flying)
print(f"tick compute p50 {compute[len(compute) // 2]:.0f} p99 {compute[len(compute) * 99 // 100]:.0f} max {compute[-1]:.0f} us; "
      f"lateness max {max(late):.0f} us")
assert 49 < rate <= 50.5, rate
assert gaps[-1] <= 0.040 + 0.020 * missed + 1e-3 * 10, f"gap of {gaps[-1] * 1e3:.1f} ms"
heartbeats = sent(raw_log.HEARTBEAT)
assert max(b - a for a, b in zip(heartbeats, heartbeats[1:])) < 1.1 + 0.02 * missed
PYTHON
