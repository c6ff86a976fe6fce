#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What the ground station may ask for, with real processes: a take-off that is refused arms nothing, hold in flight stops on the way with every sample inside its set, and follow flies each leg of a file and turns where that says so.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
refused() { # refused TEXT ARGUMENT …
  local text=$1
  shift
  if "$bin/backwashctl" --domain "$domain" "$@" >>"$log" 2>"$work/stderr"; then die "$* was not refused"; fi
  cat "$work/stderr" >>"$log"
  grep -q "$text" "$work/stderr" || die "$* did not say: $text"
}
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
refused 'not safe' takeoff --height 9 --wait
refused 'on the ground' goto 2,0,1.2
sleep 1
status
python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); assert not s["armed"], s' "$work/status.json"
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2
sleep 2
refused 'hold first' goto -2,0,1.2
ctl hold --wait
sleep 1
status
python3 - "$work/status.json" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
x = s["setpoint"][0]
print(f"held at x = {x:.2f} m, {s['samples_inside']} samples inside, {s['samples_outside']} outside")
assert s["state"] == "tracking" and not s["moving"], s
assert -1.9 < x < 1.9, "the flight was not stopped on its way"
assert s["samples_outside"] == 0 and abs(s["position"][0] - x) < 0.1, s
PYTHON

# follow: a file that is none is refused before anything is sent, by file and line; a good one is flown leg by leg.
printf 'x_m,y_m,z_m\n1.5,0.8,1.2\n1.5,far,1.2\n' >"$work/bad.csv"
refused "bad.csv:3: '1.5,far,1.2' is not three numbers" follow "$work/bad.csv"
printf '1.5,0.8,1.2\n' >"$work/bad.csv"
refused 'bad.csv:1: the first line is' follow "$work/bad.csv"
refused 'cannot be read' follow "$work/absent.csv"
printf 'x_m,y_m,z_m\n1.5,0.8,1.2\n1.5,-0.8,1.4\n-1,0,1.2\n' >"$work/route.csv"
ctl follow "$work/route.csv" --wait
sleep 0.5
status
# What RViz and the tools of diagnostics are shown, as another middleware reads it.
if [[ -x $build/tests/fastdds_viewer ]]; then
  "$build/tests/fastdds_viewer" "$domain" backwash 4 >"$work/seen" || die "markers, disturbance, path, battery or diagnostics did not come: $(cat "$work/seen")"
  cat "$work/seen"
  grep -q '^diagnostics [01] backwash backwashd: quad-5in: tracking: ' "$work/seen" || die "other diagnostics"
  grep -Eq '^markers [0-9]{2,3} in map: line of [0-9]{2,4}, boxes up to 0\.[1-9][0-9]* m wide$' "$work/seen" || die "other markers"
  grep -Eq '^battery present 1[456]\.[0-9]{2} V, 0\.[3-9][0-9], 5 not known, kinds 0 ""$' "$work/seen" || die "another battery"
  # The last leg, from 1.5,-0.8,1.4: 2.64 m as the crow flies.
  grep -Eq '^path [0-9]{2,4} in map to -1\.00 -?0\.00 1\.20, (2\.[6-9]|3\.)[0-9]* m, 0\.[01][0-9]* m at a time$' "$work/seen" || die "another path"
  # The layer of 1.2 m: one height, and of a room's air no bound of nothing or of many times free air's.
  grep -Eq '^disturbance [0-9]{3,5} in map from (1\.[0-9]{3}) to \1: level 0\.[1-9][0-9]* to [0-9.]*, vertical 0\.[1-9][0-9]* to [0-9.]*$' "$work/seen" || die "another disturbance"
fi
# With headings: two at one place, the last place on the way as well, one row without.
printf 'x_m,y_m,z_m,yaw_rad\n-1,0,1.2,1.2\n-1,0,1.2,-1.9\n0,0,1.2,\n-1,0,1.2,0.5\n' >"$work/turns.csv"
sed 's/0.5$/north/' "$work/turns.csv" >"$work/bad.csv"
refused "bad.csv:5: '-1,0,1.2,north' is not three numbers and a heading" follow "$work/bad.csv"
for row in $(seq 33); do [[ $row == 1 ]] && head -1 "$work/turns.csv"; echo 1,0,1.2,0; done >"$work/bad.csv"
refused 'bad.csv: 33 points with headings, expected 1 to 32' follow "$work/bad.csv"
ctl follow "$work/turns.csv" --wait
sleep 0.5
# Whoever waits for a flight that another station stopped is told so, and does not wait on.
"$bin/backwashctl" --domain "$domain" goto 1.5,0.8,1.2 --wait >"$work/waiting" 2>&1 &
waiting=$!
sleep 1
ctl stop --wait
code=0
wait "$waiting" || code=$?
[[ $code == 69 ]] && grep -q 'goto: a later command took its place; the daemon is hold' "$work/waiting" || die "goto ended with $code: $(cat "$work/waiting")"
ctl land --wait
stop
python3 - "$work/status.json" "$work/truth.csv" "$work/route.csv" <<'PYTHON'
import csv, json, math, sys
status = json.load(open(sys.argv[1]))
rows = [[{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(f))] for f in sys.argv[2:]]
truth, route = rows
at = 0
for point in route:  # in their order, at rest at each
    goal = [point["x_m"], point["y_m"], point["z_m"]]
    near = [n for n in range(at, len(truth)) if math.dist([truth[n][c] for c in ("x_m", "y_m", "z_m")], goal) < 0.12
            and math.hypot(truth[n]["vx_mps"], truth[n]["vy_mps"], truth[n]["vz_mps"]) < 0.15]
    assert near, f"the vehicle was never at rest at {goal}"
    at = near[0]
    print(f"at {goal} at {truth[at]['t_s'] - truth[0]['t_s']:.1f} s")
heading = lambda row: math.atan2(2 * (row["qw"] * row["qz"] + row["qx"] * row["qy"]), 1 - 2 * (row["qy"] ** 2 + row["qz"] ** 2))
for place, yaw in (((-1, 0), 1.2), ((-1, 0), -1.9), ((0, 0), None), ((-1, 0), 0.5)):  # turned to, at that place, in their order
    near = [n for n in range(at, len(truth)) if math.dist((truth[n]["x_m"], truth[n]["y_m"]), place) < 0.12 and truth[n]["z_m"] > 1
            and (yaw is None or abs(math.remainder(heading(truth[n]) - yaw, math.tau)) < 0.1)]
    assert near, f"the vehicle was never at {place} with heading {yaw}"
    at = near[0]
    print(f"at {place}, heading {yaw}, at {truth[at]['t_s'] - truth[0]['t_s']:.1f} s")
assert status["samples_outside"] == 0 and status["state"] == "tracking" and not status["moving"], status
PYTHON
