#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What the ground station may ask for, with real processes: a take-off that is refused arms nothing, a second station is
# refused by name, and hold in flight stops on the way with every sample inside its set.
#   daemon_commands.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
log=$work/log
: >"$log"
trap 'status=$?; stop; [[ $status == 0 ]] || cat "$log"; rm -rf "$work"' EXIT
refused() { # refused TEXT ARGUMENT …
  local text=$1
  shift
  if "$bin/backwashctl" --domain "$domain" "$@" >>"$log" 2>"$work/stderr"; then die "$* was not refused"; fi
  cat "$work/stderr" >>"$log"
  grep -q "$text" "$work/stderr" || die "$* did not say: $text"
}
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
refused 'not safe' takeoff --height 9 --wait
refused 'on the ground' goto 2,0,1.2
refused 'session held by' --station another land
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
ctl land --wait
