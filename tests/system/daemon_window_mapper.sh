#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The mapper of a window is killed in flight and comes back (docs/faults.md rows 13 and 55), with real processes. Without whole
# map nothing else shows the way. Judged from the raw log, the truth and what the daemon says.
#   kept: a flight goes on within what was shown     live: with map.live it is held
#   daemon_window_mapper.sh SOURCE_DIR BUILD_DIR kept|live
set -euo pipefail
source_dir=$1 build=$2 case=$3
source "$source_dir/services/bench/session.sh"
[[ $case == live ]] && live='live = true' || live=''
more_tables="[map]
$live
[map.window]
occupied = \"rt/backwash/window_occupied\"
free = \"rt/backwash/window_free\"
size_x = 4
size_y = 4
size_z = 4
resolution = 0.1"
printf 'after = "start"\n[[fault]]\nchannel = "map"\nkind = "off"\nfrom = 0\nuntil = 100000\n' >"$work/no_map.toml"
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }
# until_true SECONDS EXPRESSION: of the status `s`; p is where it is, c what is commanded.
until_true() {
  local until=$((SECONDS + $1))
  while ((SECONDS < until)); do
    status
    python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); c = s["setpoint"]; sys.exit(not eval(sys.argv[2]))' "$work/status.json" "$2" && return
    sleep 0.05
  done
  die "not within $1 s: $2: $(cat "$work/status.json")"
}
rests_at() { until_true 60 "s['state'] == 'tracking' and not s['moving'] and abs(c[0] - ($1)) < 0.01"; }
mapper_pid=''
start_mapper() {
  "$build/tests/window_mapper" "$domain" backwash builtin:parallel-walls-4m 4,4,4 >>"$log" 2>&1 &
  mapper_pid=$!
  more_pids+=("$mapper_pid")
}
taken() { grep -c "window_$1 is taken from" "$log" || true; }
# taken_again: both clouds, once more than before it was killed.
taken_again() {
  for _ in $(seq 200); do
    [[ $(taken free) -ge 2 && $(taken occupied) -ge 2 ]] && return
    sleep 0.1
  done
  die "the mapper that came back is not listened to"
}
mark() { date +"$1 %s.%N" >>"$work/marks"; } # CLOCK_REALTIME; the log's is the monotonic one

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv" --faults "$work/no_map.toml"
start_mapper
start_daemon builtin:quad-5in "$work/flight.bwlog"
for _ in $(seq 50); do [[ $(taken free) -ge 1 ]] && break; sleep 0.1; done
sleep 1.5 # what the window shows is in the world
enable
ctl takeoff --height 1.2 --wait
ctl goto -1.2,0,1.2
rests_at -1.2
sleep 1
ctl goto 0.3,0,1.2
sleep 0.3 # it moves, and has shown no more yet
kill -KILL "$mapper_pid"
python3 -c 'import time; print(time.monotonic())' >"$work/killed"
wait "$mapper_pid" 2>>"$log" || true
if [[ $case == live ]]; then
  until_true 10 "s['state'] == 'hold' and 'map' in s['reason']"
  cp "$work/status.json" "$work/held.json"
  until_true 10 "not s['moving']"
else
  rests_at 0.3
fi
# Beyond what was shown it does not go, and says why: one outside of its world is refused at once; towards one in it the vehicle goes
# as far as it may, and the task says that this was all.
"$bin/backwashctl" --domain "$domain" goto 9,0,1.2 --wait >"$work/refused" 2>&1 && die "a goal outside of the world was taken"
if [[ $case == kept ]]; then
  ctl goto 2,0,1.2
  until_true 40 "s['state'] == 'tracking' and not s['moving'] and 'nothing more of the way became known' in s['task']"
  cp "$work/status.json" "$work/ended.json"
fi
# It is back before its lease of 10 s has ended: until then its clouds are refused by name.
start_mapper
taken_again
until_true 20 "0 <= s['map_age_s'] < 1"
sleep 1
printf 'x_m,y_m,z_m\n0.8,0,1.2\n2,0,1.2\n' >"$work/way.csv"
ctl follow "$work/way.csv"
rests_at 2
sleep 0.5
status
stop
cp "$log" "$work/said"
"$build/services/backwash" report --quiet --json "$work/flight.bwlog" --truth "$work/truth.csv" >"$work/report.json" 2>"$work/reported" || true
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$case" <<'PYTHON'
import csv, json, math, re, struct, sys
import raw_log
work, case = sys.argv[1], sys.argv[2]
status, report = (json.load(open(f"{work}/{name}.json")) for name in ("status", "report"))
said, refused = open(work + "/said").read(), open(work + "/refused").read().strip()
killed = float(open(work + "/killed").read())
truth = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(work + "/truth.csv"))]
flight = work + "/flight.bwlog"
ticks = list(raw_log.ticks(flight))
gone = re.findall(r"refused: (rt/backwash/window_(\w+) of writer \S+ is gone: what it has shown is flown in, and nothing beyond)", said)
in_use = re.findall(r"refused: (rt/backwash/window_\w+ of writer \S+: that of \S+ is in use)", said)
print(f"goto beyond: {refused}")
assert {g[1] for g in gone} == {"free", "occupied"}, gone
assert in_use or case == "kept", "nobody said that the second mapper waits for the first"
events = [e["what"] for e in report["events"] if e["kind"] == "map"]
assert sum("is gone" in e for e in events) == 2, events
assert "goal (9.00, 0.00, 1.20) is outside the world of the window, (-" in refused, refused
if case == "kept":
    print("task:", json.load(open(work + "/ended.json"))["task"])
# What was flown while nobody saw: within what the last cloud had shown, 2 m ahead of where it was.
at_kill = min(truth, key=lambda r: abs(r["t_s"] - killed))
back = next(t for t, line in raw_log.lines(flight, raw_log.SCAN) if t > killed + 1 and line.startswith("occupied"))
blind = [r for r in truth if killed < r["t_s"] < back]
far = max(r["x_m"] for r in blind)
print(f"killed at x = {at_kill['x_m']:.2f} m, blind for {back - killed:.1f} s, there at most at x = {far:.2f} m")
assert far < at_kill["x_m"] + 2 - 0.16 and back - killed > 3, (far, back - killed)
flying = [t for t in ticks if killed < t.t < max(t.t for t in ticks if t.mode == "tracking")]
modes = {t.mode for t in flying}
holds = [t for t in flying if t.mode == "hold"]
if case == "live":
    held = json.load(open(work + "/held.json"))
    print(f"held {holds[0].t - killed:.2f} s after the kill: {held['reason']}")
    assert holds[0].t < killed + 1.2 and holds[-1].t < back + 10, holds[0].t - killed
    assert modes == {"tracking", "hold"}, modes
else:
    assert modes == {"tracking"}, modes
assert status["samples_outside"] == 0 and status["samples_inside"] > 300, status
assert math.dist([truth[-1][c] for c in ("x_m", "y_m", "z_m")], [2, 0, 1.2]) < 0.12, truth[-1]
# The walls are at y = -2 and 2, the floor at 0.
clear = min(min(2 - abs(r["y_m"]), r["z_m"] if r["x_m"] > -1.9 else 1) for r in truth) - 0.16
print(f"least to wall or floor: {clear:.2f} m")
assert clear > 0.2, clear
assert report["judged_by"] == "truth" and report["ticks_not_judged"] > 300 and not report["touched"] and report["window"]["clouds"] > 50, report
PYTHON
