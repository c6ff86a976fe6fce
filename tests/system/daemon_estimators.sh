#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Odometry as estimators really fill it (docs/faults.md row 53). A daemon that is told who it is flies: VINS-Fusion's twist is
# in the frame of the pose, FAST-LIO's is zero, motion capture sends poses alone, others transforms among those of joints. One
# that takes FAST-LIO for an estimator by the letter enables nothing.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/$1.json" 2>>"$log"; }

# flies NAME TABLES OPTION …, of the bench: takes off and goes 3 m, every sample inside its set.
flies() {
  rm -f "$work/autopilot"
  start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${@:3}"
  more_tables=$(printf "$2")
  start_daemon builtin:quad-5in "$work/$1.bwlog"
  enable
  ctl takeoff --height 1.2 --wait
  ctl goto 1 0 1.2 --wait
  status "$1"
  ctl land --wait
  stop
  python3 - "$work/$1.json" "$1" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
off = max(abs(a - b) for a, b in zip(s["position"], (1, 0, 1.2)))
print(f"{sys.argv[2]}: {s['samples_inside']} samples inside, {s['samples_outside']} outside, {off:.3f} m off the goal")
assert s["samples_inside"] > 100 and s["samples_outside"] == 0 and off < 0.15, s
PYTHON
}

for estimator in vins_fusion:world fast_lio:camera_init openvins:global; do
  profile=${estimator%:*}
  flies "$profile" "[odometry]\nprofile = \"$profile\"\n[frames]\nmap = \"${estimator#*:}\"" --estimator "$profile"
done
for message in pose tf; do
  flies $message "[odometry]\nprofile = \"custom\"\nmessage = \"$message\"" --pose-message $message
done

rm -f "$work/autopilot"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --estimator fast_lio
more_tables=$(printf '[odometry]\nprofile = "ros"\n[frames]\nmap = "camera_init"\nbody = "base_link"')
write_configuration builtin:quad-5in "$work/wrong.bwlog"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
sleep 3
status wrong
python3 - "$work/wrong.json" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
print("by the letter:", s["refused"])
assert "'body'" in s["refused"] and "fast_lio" in s["refused"], s["refused"]
PYTHON
stop

# OpenVINS sends no loop closure: where its frame is said to be that of the odometry nothing is taken, and the preflight says why.
rm -f "$work/autopilot"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --estimator openvins
more_tables=$(printf '[odometry]\nprofile = "openvins"\n[frames]\nodometry = "global"')
write_configuration builtin:quad-5in "$work/waits.bwlog"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
sleep 3
code=0
"$bin/backwashctl" --domain "$domain" check >"$work/waits.txt" 2>>"$log" || code=$?
[[ $code == 69 ]] && grep -q "refused: .*before the first loop_closure from it to 'map'" "$work/waits.txt" || { cat "$work/waits.txt"; die "check does not say what odometry waits for"; }
