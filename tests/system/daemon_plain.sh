#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The daemon on the plain serial link: a controller that uses firmware_bridge/plain is enabled, takes off, hovers and lands.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
"$build/tests/plain_controller" "$work/autopilot" "$work/plain" >"$work/controller" 2>>"$log" &
controller=$!
more_pids+=("$controller")
for _ in $(seq 100); do [[ -e $work/plain ]] && break; sleep 0.05; done
device=$work/plain more_link='protocol = "plain"'
start_daemon builtin:quad-5in "$work/flight.bwlog"
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/$1" 2>>"$log"; }
enable
ctl takeoff --height 1.2 --wait
sleep 3
status hover
ctl land --wait
status landed
kill -TERM "$controller"
wait "$controller" || die "the controller failed"
cat "$work/controller"
python3 - "$work" <<'PYTHON'
import json, re, sys
hover, landed = (json.load(open(f"{sys.argv[1]}/{name}")) for name in ("hover", "landed"))
print({k: hover[k] for k in ("state", "position", "setpoint", "frames_bad")}, landed["state"])
assert hover["armed"] and hover["offboard"] and not hover["landed"], hover
assert max(abs(a - b) for a, b in zip(hover["position"], hover["setpoint"])) < 0.15, hover
assert hover["position"][2] > 1, hover
assert not landed["armed"] and landed["landed"], landed
assert hover["frames_bad"] == landed["frames_bad"] == 0, landed
setpoints, poses, requests, refused = map(int, re.findall(r"\d+", open(f"{sys.argv[1]}/controller").read()))
assert setpoints > 200 and poses > 100 and requests >= 3 and refused == 0, (setpoints, poses, requests, refused)
PYTHON
