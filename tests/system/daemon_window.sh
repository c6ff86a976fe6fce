#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A mapper's occupancy window that moves along (docs/faults.md row 55), with real processes. Judged from the raw log, the
# truth and what the daemon says.
#   obstacle: a cube appears in the window, on the path      kept, reload: one that the window has left, and with no room to keep it
#   alone: no whole map at all                               refused: what looks like something else
#   pieces: a whole map whose world does not fit into map.max_mib, and no clouds: its parts come and go
#   daemon_window.sh SOURCE_DIR BUILD_DIR obstacle|kept|reload|alone|pieces|refused
set -euo pipefail
source_dir=$1 build=$2 case=$3
source "$source_dir/services/bench/session.sh"
size=4,4,3 keep=16777216 cubes=() options=(--log "$work/truth.csv")
case $case in
  obstacle) cubes=(1.3,0,1.2,0.4,-0.8,100) ;;
  kept | reload) size=2,2,2 cubes=(-0.9,0,1.2,0.6,-100,1) ;;
  alone | pieces)
    size=4,4,4
    printf '[[fault]]\nchannel = "map"\nkind = "off"\nfrom = 0\nuntil = 100000\n' >"$work/no_map.toml"
    sed -i '1i after = "start"' "$work/no_map.toml"
    options+=(--faults "$work/no_map.toml")
    ;;
esac
[[ $case == reload ]] && keep=9261
IFS=, read -r x y z <<<"$size"
more_tables="[map.window]
occupied = \"rt/backwash/window_occupied\"
free = \"rt/backwash/window_free\"
size_x = $x
size_y = $y
size_z = $z
resolution = 0.1
keep_voxels = $keep"
mapper() { exec "$build/tests/window_mapper" "$domain" backwash builtin:parallel-walls-4m "$size" "$@" >>"$log" 2>&1; }
# at GOAL: waits until the vehicle rests there.
at() {
  for _ in $(seq 240); do
    sleep 0.5
    "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
    python3 - "$work/status.json" "$1" <<'PYTHON' && return
import json, math, sys
s = json.load(open(sys.argv[1]))
goal = [float(x) for x in sys.argv[2].split(",")]
over = s["state"] in ("quiet", "passive")
sys.exit(0 if over or (s["state"] == "tracking" and not s["moving"] and math.dist(s["setpoint"], goal) < 0.01) else 1)
PYTHON
  done
  die "it is not at $1"
}

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${options[@]}"
if [[ $case == refused ]]; then
  start_daemon builtin:quad-5in "$work/flight.bwlog"
  expect() { # expect FAULT PATTERN…: each is in the log
    local fault=$1 pattern
    shift
    (mapper "$fault")
    for pattern in "$@"; do grep -Eq "refused: $pattern" "$log" || die "of $fault nothing said: $pattern"; done
  }
  writer='of writer [0-9a-f]{8}:[0-9a-f:]+'
  expect frame "rt/backwash/window_occupied $writer: header.frame_id 'camera_init', wanted 'map' .frames.map." \
    "rt/backwash/window_free $writer: header.frame_id"
  expect distances "rt/backwash/window_occupied $writer: field intensity 0 to 2.97 looks like distances.*map.window.occupied" \
    "rt/backwash/window_free .*map.window.free"
  expect finer "rt/backwash/window_free $writer: resolution: its points lie 0.05 m apart, wanted 0.1 m .map.window.resolution"
  expect nan "rt/backwash/window_occupied $writer: x, y, z: 1 points are not finite, wanted none"
  "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
  python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); assert s["scans_accepted"] == 0 and s["scans_rejected"] >= 40, s' "$work/status.json"
  grep "refused: rt/backwash/window" "$log" | sed 's/.*refused: //' | cut -c1-200 | sort -u
  exit 0
fi
if [[ $case == pieces ]]; then
  # 400 x 300 x 80 voxels: the same walls, and free space around them.
  "$bin/backwash" map convert builtin:parallel-walls-4m --crop=-20,-15,-3,20,15,5 --free-from=-10,0,1 --quiet -o "$work/large.bt" >>"$log"
  {
    until grep -q 'odometry is taken' "$log"; do sleep 0.1; done
    "$bin/backwashctl" --domain "$domain" map "$work/large.bt" >"$work/sent" 2>&1 || echo "failed" >>"$work/sent"
  } &
else
  mapper "${cubes[@]}" & # exec: who ends this one ends the mapper, not a shell around it
fi
more_pids+=($!)
start_daemon builtin:quad-5in "$work/flight.bwlog"
[[ $case == pieces ]] || for _ in $(seq 50); do grep -q 'window_free is taken from' "$log" && break; sleep 0.1; done
sleep 1.5 # what the window shows is in the world
enable
ctl takeoff --height 1.2 --wait
if [[ $case == alone || $case == pieces ]]; then
  printf 'x_m,y_m,z_m\n-0.8,0,1.2\n0.6,0,1.2\n2,0,1.2\n' >"$work/way.csv"
  ctl follow "$work/way.csv"
else
  ctl goto 2,0,1.2
fi
at 2,0,1.2
if [[ $case == kept || $case == reload ]]; then
  ctl goto -2,0,1.2
  at -2,0,1.2
fi
sleep 1
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
stop

cp "$log" "$work/said"
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$case" <<'PYTHON'
import csv, json, math, re, sys
import raw_log
work, case = sys.argv[1], sys.argv[2]
status = json.load(open(work + "/status.json"))
said = open(work + "/said").read()
truth = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(work + "/truth.csv"))]
flight = work + "/flight.bwlog"
ticks = list(raw_log.ticks(flight))
goal = [-2 if case in ("kept", "reload") else 2, 0, 1.2]
assert math.dist(status["setpoint"], goal) < 0.01 and status["state"] == "tracking", status
assert status["samples_outside"] == 0 and status["samples_inside"] > 300, status
assert case == "pieces" or (status["scans_accepted"] > 50 and status["map_age_s"] < 2), status
end = truth[-1]
assert math.dist([end["x_m"], end["y_m"], end["z_m"]], goal) < 0.12, end
flying = [t for t in ticks if t.mode in ("tracking", "hold")]
missed = max(t.missed for t in flying) * 0.020
print(f"{status['scans_accepted']} clouds, {status['scans_rejected']} refused")

def nearest(center, edge, rows):
    return min(math.dist([max(abs(r[c] - m) - edge / 2, 0) for c, m in zip(("x_m", "y_m", "z_m"), center)], [0] * 3) for r in rows)

if case == "obstacle":
    windows = raw_log.lines(flight, raw_log.SCAN)
    armed = next(t.t for t in ticks if t.mode == "tracking")
    first = next(t for t, line in windows if t > armed and line.startswith("occupied") and not line.endswith(" 0 new voxels"))
    hold = next(t for t in ticks if t.mode == "hold")
    world = next(t for t, _ in raw_log.lines(flight, raw_log.WORLD) if t > first)
    print(f"cloud +{(hold.t - first) * 1e3:.1f} ms hold, +{(world - first) * 1e3:.0f} ms new snapshot")
    assert hold.t - first <= 0.040 + missed, hold.t - first
    assert hold.t < world, "the decision waited for the field"
    clear = nearest((1.3, 0, 1.2), 0.4, [r for r in truth if r["t_s"] > first])
    print(f"nearest to the cube: {clear:.3f} m")
    assert clear > 0.16, "it touched the cube"
    assert any(t.mode == "tracking" and t.t > hold.t for t in ticks), "it did not go on"
elif case in ("alone", "pieces"):
    made = re.findall(r"world of the window made around the vehicle: (\d+) x (\d+) x (\d+) voxels in (\d+) ms", said)
    worlds = [m[:3] for m in made]
    print(f"{len(worlds)} worlds of {' x '.join(worlds[0])} voxels, one after the other, in {', '.join(m[3] for m in made)} ms")
    assert len(worlds) >= 3 and set(worlds) == {("60", "60", "60")}, worlds
    assert status["maps_accepted"] == (case == "pieces"), status
    if case == "pieces":
        sent = open(work + "/sent").read()
        print(sent.strip())
        assert "400 x 300 x 80 voxels: the daemon takes it with map.max_mib = 1053 or more" in sent and "is in use" in sent, sent
        assert "map accepted: 400 x 300 x 80 voxels" in said and status["scans_accepted"] == 0, status
    assert not [t for t in flying if t.mode == "hold"], "it was held"
else:
    turned = max(range(len(truth)), key=lambda n: truth[n]["x_m"])
    beside = [max(abs(r["y_m"]) + abs(r["z_m"] - 1.2) for r in way if abs(r["x_m"] + 0.9) < 0.3) for way in (truth[:turned], truth[turned:])]
    gone = [int(n) for n in re.findall(r"let go, (\d+) of them occupied", said)]
    print(f"beside the straight line where the cube is: out {beside[0]:.2f} m, back {beside[1]:.2f} m; {sum(gone)} of its and the walls' voxels let go")
    assert nearest((-0.9, 0, 1.2), 0.6, truth[:turned]) > 0.16 and beside[0] > 0.4, "it flew through the cube"
    if case == "kept":
        assert not gone and beside[1] > 0.4, "what the window has left was forgotten"
    else:
        assert sum(gone) >= 216 and beside[1] < 0.2, "it was not let go"
PYTHON
