#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# RViz's goals (backwashctl goals): Fast DDS sends poses, the daemon flies to those that are goals. What is none is refused
# by name and moves nothing. Between goals no session is held: another station's hold and land are done.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$bin/backwashctl" --domain "$domain" --station rviz goals --height 1.2 >"$work/goals" 2>&1 &
goals=$!
"$bin/backwashctl" --domain "$domain" --station own goals --topic /deep/goal --frame world --heading path >"$work/own" 2>&1 &
own=$!
more_pids+=("$goals" "$own")
send() { "$build/tests/fastdds_goal" "$domain" "$@" || die "nobody took the goal $*"; }
told() { # told FILE TEXT: waits for it
  for _ in $(seq 100); do ! grep -q -- "$2" "$1" || return 0; sleep 0.1; done
  cat "$1" >&2
  die "'$2' was not told"
}
at() { # at X Y: waits until the vehicle rests there
  for _ in $(seq 150); do
    "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
    ! python3 - "$work/status.json" "$@" <<'PYTHON' || return 0
import json, math, sys
s = json.load(open(sys.argv[1]))
goal = [float(v) for v in sys.argv[2:]] + [1.2]
sys.exit(not (s["state"] == "tracking" and not s["moving"] and s["task"][:7] in ("", "refused") and math.dist(s["setpoint"], goal) < 0.01))
PYTHON
    sleep 0.2
  done
  cat "$work/status.json" >&2
  die "it does not rest at $*"
}

# What is no goal. No set-point moves.
send rt/goal_pose odom 0 1 0 0 0 0 0 1
told "$work/goals" "header.frame_id is 'odom', expected 'map'"
send rt/goal_pose map 60 1 0 0 0 0 0 1
told "$work/goals" "header.stamp is 60.[0-9]* s old, expected at most 5.00 s"
send rt/goal_pose map -60 1 0 0 0 0 0 1
told "$work/goals" "header.stamp is -[56][0-9.]* s old"
send rt/goal_pose map 0 nan 0 0 0 0 0 1
told "$work/goals" "pose.position is not finite"
send rt/goal_pose map 0 1 0 0 0 0 0 2
told "$work/goals" "pose.orientation has length 2.00, expected 1, or 0 for no heading"
send rt/goal_pose map 0 1 0 0 0.6 0 0 0.8
told "$work/goals" "pose.orientation is tilted by 1.29 rad"
send rt/goal_pose map 0 50 0 0 0 0 0 1
told "$work/goals" "refused: "
send rt/deep/goal world none 1 0 0 0 0 0 1
told "$work/own" "pose.position.z is 0, as RViz's goal on the ground plane has it: give --height"
at -2 0

# A goal on the ground plane with a heading, then one in space without.
send rt/goal_pose map 0 1 0 0 0 0 0.70710678 0.70710678
told "$work/goals" "^1.00,0.00,1.20 facing 1.57 rad: accepted"
at 1 0
send rt/deep/goal world none -1 0 1.2 0 0 0 0
told "$work/own" "^-1.00,0.00,1.20: accepted"
at -1 0

# Nobody holds the session: others command at once, and a goal after a STOP is a later command like any other.
send rt/goal_pose map 0 2 0 0 0 0 0 1
told "$work/goals" "^2.00,0.00,1.20 facing 0.00 rad: accepted"
ctl --station other hold --wait
ctl --station other stop --wait
[[ $(grep -c ': accepted$' "$work/goals") == 2 ]] || die "a goal was flown to twice"
kill -INT "$goals" "$own"
wait "$goals" && code=0 || code=$?
[[ $code == 130 ]] || die "interrupted, it ended with $code"
wait "$own" || true
ctl --station other land --wait
cat "$work/goals" "$work/own"
"$bin/backwashctl" --domain "$domain" goals --topic goal >"$work/bad" 2>&1 && die "took a name that is no topic"
grep -q "'goal' is no topic; it takes a / first" "$work/bad" || die "$(cat "$work/bad")"
stop
python3 - "$work/truth.csv" <<'PYTHON'
import csv, math, sys
rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(open(sys.argv[1]))]
heading = lambda r: math.atan2(2 * (r["qw"] * r["qz"] + r["qx"] * r["qy"]), 1 - 2 * (r["qy"] ** 2 + r["qz"] ** 2))
turned = [r for r in rows if math.dist((r["x_m"], r["y_m"], r["z_m"]), (1, 0, 1.2)) < 0.12 and abs(heading(r) - math.pi / 2) < 0.1]
print(f"{len(turned)} rows at the first goal, turned as it says")
assert turned, "it never faced as its goal says"
PYTHON
