#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The preflight over the emulated controller: with PX4 parameters that are unsafe indoors each is named with what to do, and
# nothing else is; with safe ones all is good.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
check() { # check NAME: the preflight's lines and its exit code, once the daemon has read all parameters
  sleep 7
  code=0
  "$bin/backwashctl" --domain "$domain" check >"$work/$1" 2>&1 || code=$?
  cat "$work/$1"
}

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --parameter COM_OF_LOSS_T=0.45 \
  --parameter COM_OBL_RC_ACT=3 --parameter COM_RC_OVERRIDE=1 --parameter NAV_DLL_ACT=2 --parameter COM_LOW_BAT_ACT=3
start_daemon builtin:quad-5in "$work/flight.bwlog"
check unsafe
[[ $code == 69 ]] || die "check exited with $code"
for line in 'COM_OF_LOSS_T: 0.45 -> set COM_OF_LOSS_T above 0 and to 0.39 s' 'COM_OBL_RC_ACT: 3 -> set COM_OBL_RC_ACT to' \
  'COM_RC_OVERRIDE: 1 -> set COM_RC_OVERRIDE to 3' 'NAV_DLL_ACT: 2 -> set NAV_DLL_ACT to' \
  'COM_LOW_BAT_ACT: 3 -> set COM_LOW_BAT_ACT to'; do
  grep -q "^FAIL  $line" "$work/unsafe" || die "check did not say: $line"
done
[[ $(grep -c ^FAIL "$work/unsafe") == 5 ]] || die "check found more than the five parameters"
"$bin/backwashctl" --domain "$domain" enable >"$work/enable" 2>&1 && die "it was enabled with a failsafe that climbs"
grep -q 'enable: refused: COM_OBL_RC_ACT is 3: set COM_OBL_RC_ACT to' "$work/enable" || die "$(cat "$work/enable")"  # what is only told forbids nothing
"$bin/backwashctl" --domain "$domain" check --json >"$work/json" 2>>"$log" && die "check --json passed"
python3 - "$work/json" <<'PYTHON'
import json, sys
found = json.load(open(sys.argv[1]))
bad = {f["name"] for f in found["findings"] if not f["good"]}
assert not found["good"] and all(f["advice"] for f in found["findings"] if not f["good"]), found
assert bad == {"COM_OF_LOSS_T", "COM_OBL_RC_ACT", "COM_RC_OVERRIDE", "NAV_DLL_ACT", "COM_LOW_BAT_ACT"}, bad
PYTHON
stop

rm -f "$work/autopilot"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/second.bwlog"
check safe
[[ $code == 0 ]] || die "check exited with $code although all is safe"
! grep -q ^FAIL "$work/safe" || die "check failed something that is good"
# What is locked is resident: no thread has the 8 MiB of stack that it would have by itself.
if [[ $(ulimit -s) == 8192 ]]; then
  large=$(grep -c '^Size: *8192 kB' "/proc/$daemon_pid/smaps" || true)
  small=$(grep -c '^Size: *512 kB' "/proc/$daemon_pid/smaps" || true)
  echo "stacks of 8 MiB: $large, of 512 KiB: $small"
  [[ $large == 0 && $small -ge 10 ]] || die "a thread has a stack of 8 MiB"
fi
