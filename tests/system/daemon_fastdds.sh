#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A foreign middleware as ROS 2 brings it: a Fast DDS process is the daemon's only odometry and reads its status. A second
# one sends odometry that breaks off in the middle: counted, and nothing else (docs/faults.md row 27). Others send poses alone,
# in each type that odometry.message names.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
# The bench's own odometry goes where nobody listens.
start_daemon builtin:quad-5in "$work/flight.bwlog" rt/foreign/odometry
"$build/tests/fastdds_peer" "$domain" rt/foreign/odometry rt/backwash/status -2 0 0.16 8 odometry >"$work/peer" &
peer=$!
sleep 6
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
wait "$peer" || die "the peer read no status"
cat "$work/peer"
grep -q '^quad-5in passive$' "$work/peer" || die "the peer read another status"
python3 - "$work/status.json" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
print(f"{s['odometry_received']} samples received, age {s['odometry_age_s']:.3f} s, at {s['position']}")
assert s["odometry_received"] > 100 and s["odometry_rejected"] == s["odometry_refused"] == 0, s
assert s["position"] == [-2, 0, 0.16] and s["odometry_age_s"] < 0.1, s
PYTHON
"$build/tests/fastdds_peer" "$domain" rt/foreign/odometry rt/backwash/status -2 0 0.16 3 cut >"$work/peer"
"$bin/backwashctl" --domain "$domain" status --json >"$work/cut.json"
python3 - "$work/status.json" "$work/cut.json" <<'PYTHON'
import json, sys
before, after = (json.load(open(f)) for f in sys.argv[1:])
print(f"{after['odometry_refused']} broken samples counted")
assert after["odometry_refused"] > 100 and after["foreign_writers"] == 0, after
assert after["odometry_rejected"] == 0 and after["state"] == "passive", after
PYTHON

# takes MESSAGE: a daemon that is told so hears the vehicle where the peer says it is.
takes() {
  kill -TERM "$daemon_pid"
  wait "$daemon_pid" || true
  more_tables=$(printf '[odometry]\nprofile = "custom"\nmessage = "%s"' "$1")
  start_daemon builtin:quad-5in "$work/$1.bwlog" rt/foreign/poses
  "$build/tests/fastdds_peer" "$domain" rt/foreign/poses rt/backwash/status -2 0 0.16 4 "$1" >"$work/peer" &
  peer=$!
  sleep 3.5
  "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
  wait "$peer" || die "the peer read no status"
  python3 - "$work/status.json" "$1" <<'PYTHON'
import json, sys
s = json.load(open(sys.argv[1]))
print(f"{sys.argv[2]}: {s['odometry_received']} received, {s['odometry_refused']} refused ({s['refused']}), at {s['position']}")
# Before the velocity is known, and of the joint before the vehicle's own: some 0.2 s.
assert s["odometry_received"] > 100 and s["odometry_rejected"] == 0 and s["odometry_refused"] < 40, s
assert s["position"] == [-2, 0, 0.16] and s["odometry_age_s"] < 0.1 and s["foreign_writers"] == 0, s
assert s["loop_closures"] == (sys.argv[2] == "tf"), s
PYTHON
}
for message in pose pose_with_covariance tf; do takes $message; done
