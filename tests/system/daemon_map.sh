#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The map changes in flight, with real processes (docs/faults.md rows 4 and 14): a crate appears on the path, a
# loop closure corrects the VIO by a quarter of a metre, or the goal lies in a part of the room that the map does not hold
# and scans reveal on the way. Judged from the raw log, the truth and the bytes on the wire.
#   daemon_map.sh SOURCE_DIR BUILD_DIR obstacle|closure|unknown
set -euo pipefail
source_dir=$1 build=$2 fault=$3
source "$source_dir/services/bench/session.sh"
options=(--log "$work/truth.csv" --wire "$work/wire.csv")
[[ $fault == obstacle ]] && options+=(--crate 1.3,0,1.2 --crate-edge 0.4 --event-x -0.8)
[[ $fault == closure ]] && options+=(--drift 0,0.25,0 --event-x -0.8)
[[ $fault == unknown ]] && options+=(--hide -0.2,-2.2,-0.2,2.7,2.2,3.7)
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${options[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2 --yaw 1
# A closure of another writer than the VIO's: it moves nothing.
[[ $fault == closure ]] && "$build/tests/dds_probe" "$domain" backwash closure
for _ in $(seq 240); do
  sleep 0.5
  "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
  python3 - "$work/status.json" <<'PYTHON' && break
import json, math, sys
s = json.load(open(sys.argv[1]))
over = s["state"] in ("quiet", "passive")
sys.exit(0 if over or (s["state"] == "tracking" and not s["moving"] and math.dist(s["setpoint"], [2, 0, 1.2]) < 0.01) else 1)
PYTHON
done
sleep 1
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
stop

cp "$log" "$work/said"
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$fault" <<'PYTHON'
import csv, json, math, sys
import raw_log
work, fault = sys.argv[1], sys.argv[2]
status = json.load(open(work + "/status.json"))
truth = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(work + "/truth.csv"))]
flight = work + "/flight.bwlog"
ticks = list(raw_log.ticks(flight))
assert math.dist(status["setpoint"], [2, 0, 1.2]) < 0.01 and status["state"] == "tracking", status
assert status["samples_outside"] == 0 and status["samples_inside"] > 400, status
flying = [t for t in ticks if t.mode in ("tracking", "hold")]
missed = max(t.missed for t in flying) * 0.020
end = truth[-1]
heading = math.atan2(2 * (end["qw"] * end["qz"] + end["qx"] * end["qy"]), 1 - 2 * (end["qy"] ** 2 + end["qz"] ** 2))
print(f"heading at the goal {heading:.2f} rad, asked for 1")
assert abs(heading - 1) < 0.1, heading
if fault == "obstacle":
    scans = raw_log.lines(flight, raw_log.SCAN)
    first = next(t for t, line in scans if not line.endswith(" 0 new voxels"))
    hold = next(t for t in ticks if t.mode == "hold")
    world = next(t for t, _ in raw_log.lines(flight, raw_log.WORLD) if t > first)
    print(f"scan +{(hold.t - first) * 1e3:.1f} ms hold, +{(world - first) * 1e3:.0f} ms new snapshot; {len(scans)} scans")
    # The scan is recorded once its voxels were handed over: the tick may be the earlier one.
    assert hold.t - first <= 0.040 + missed, hold.t - first
    assert hold.t < world, "the decision waited for the field"
    nearest = min(math.dist([max(abs(r[c] - m) - 0.2, 0) for c, m in zip(("x_m", "y_m", "z_m"), (1.3, 0, 1.2))], [0] * 3)
                  for r in truth if r["t_s"] > first)
    print(f"nearest to the crate: {nearest:.3f} m")
    assert nearest > 0.16, "it touched the crate"
    assert any(t.mode == "tracking" and t.t > hold.t for t in ticks), "it did not go on"
elif fault == "unknown":
    said = open(work + "/said").read()
    extended = sum("] extended from" in line for line in said.splitlines())
    holds = sum(a.mode == "tracking" and b.mode == "hold" for a, b in zip(ticks, ticks[1:]))
    print(f"{extended} extensions, {holds} holds, {status['scans_accepted']} scans")
    assert "towards a goal that is not known" in said, "the goal was known from the start"
    assert extended >= 2 and status["scans_accepted"] > 5, (extended, status)
    assert math.dist([end["x_m"], end["y_m"], end["z_m"]], [2, 0, 1.2]) < 0.12, "not at the goal"
else:
    assert status["loop_closures"] == 2 and status["closures_refused"] == 1, status
    assert "a loop closure of writer" in status["refused"], status
    assert not [t for t in flying if t.mode == "hold"], "a flagged loop closure is no fault"
    points = [(float(r["t_s"]), [float(r[c]) for c in "xyz"]) for r in csv.DictReader(open(work + "/wire.csv"))
              if r["id"] == str(raw_log.SETPOINT)]
    steps = [math.dist(a[1], b[1]) for a, b in zip(points, points[1:])]
    print(f"largest set-point step {max(steps) * 1e3:.1f} mm; the VIO itself still off by "
          f"{end['y_m'] - end['vio_y_m']:.2f} m; at the goal ({end['x_m']:.2f}, {end['y_m']:.2f}, {end['z_m']:.2f}) m")
    assert max(steps) <= 1.5 * 0.02 * (1 + missed / 0.02) + 1e-4, max(steps)
    assert abs(end["y_m"] - end["vio_y_m"] - 0.25) < 0.05, "there was no drift to correct"
    assert math.dist([end["x_m"], end["y_m"], end["z_m"]], [2, 0, 1.2]) < 0.12, "not at the goal of the map"
PYTHON
