#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A foreign middleware as ROS 2 brings it: a Fast DDS process is the daemon's only odometry and reads its status. A second
# one sends odometry that breaks off in the middle: counted, and nothing else (docs/faults.md row 27).
#   daemon_fastdds.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
# The bench's own odometry goes where nobody listens.
start_daemon builtin:quad-5in "$work/flight.bwlog" rt/foreign/odometry
"$build/tests/fastdds_peer" "$domain" rt/foreign/odometry rt/backwash/status -2 0 0.16 8 >"$work/peer" &
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
