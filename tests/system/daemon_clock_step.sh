#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The wall clock really steps in flight (docs/faults.md row 30), as the daemon and its middleware see it: an hour
# forward, two back, an hour forward, half a second apart (clock_shim.c). The flight reaches its goal, no sample is
# rejected, and between two set-points passes no more time than what a stolen processor took.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
step() { python3 -c 'import struct, sys; open(sys.argv[1], "r+b").write(struct.pack("<q", int(sys.argv[2])))' "$work/offset" "$1"; }
truncate -s 8 "$work/offset"
# The shim is the daemon's alone: the bench's clocks are a sender's.
printf '#!/bin/sh\nCLOCK_SHIM=%s LD_PRELOAD=%s exec %s "$@"\n' "$work/offset" "$build/tests/libclock_shim.so" \
  "${BACKWASHD:-$build/services/backwashd}" >"$work/backwashd"
chmod +x "$work/backwashd"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
BACKWASHD=$work/backwashd start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$bin/backwashctl" --domain "$domain" status --json >"$work/before.json"
ctl goto 2,0,1.2
stepped=$(python3 -c 'import time; print(time.monotonic())')
for by in 3600 -3600 0; do
  sleep 0.5
  step "$by"
  # Refused while it flies; the daemon answers, and says so with its clock's time.
  "$bin/backwashctl" --domain "$domain" goto 2,0,1.2 >>"$log" 2>&1 || true
done
# As long as it flies: a slow machine's flight is a later one, not a worse one.
arrived() {
  "$bin/backwashctl" --domain "$domain" status --json >"$work/after.json" &&
    python3 -c 'import json, math, sys; sys.exit(not math.dist(json.load(open(sys.argv[1]))["setpoint"], [2, 0, 1.2]) < 0.01)' "$work/after.json"
}
for _ in $(seq 60); do ! arrived || break; sleep 0.5; done
sleep 1
"$bin/backwashctl" --domain "$domain" status --json >"$work/after.json"
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$stepped" <<'PYTHON'
import json, math, re, sys, time
import raw_log
work, stepped = sys.argv[1], float(sys.argv[2])
before, after = (json.load(open(f"{work}/{n}.json")) for n in ("before", "after"))
ticks = [t for t in raw_log.ticks(work + "/flight.bwlog") if t.t > stepped]
missed = sum(t.missed for t in ticks)
sent = [t for t, i, _ in raw_log.wire(work + "/wire.csv") if i == raw_log.SETPOINT and t > stepped]
gap = max(b - a for a, b in zip(sent, sent[1:]))
said = [time.mktime(time.strptime(m, "%Y-%m-%d %H:%M:%S")) - time.time()
        for m in re.findall(r"^\[(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d)[.\]]", open(work + "/log").read(), re.M)]
print(f"at {after['setpoint']}, {after['odometry_rejected'] - before['odometry_rejected']} samples rejected, "
      f"{missed} periods missed, largest gap {gap * 1e3:.0f} ms")
assert max(said) > 3000 and min(said) < -3000, "the daemon's clock did not step"
assert math.dist(after["setpoint"], [2, 0, 1.2]) < 0.01 and after["state"] == "tracking", after
assert after["odometry_rejected"] == before["odometry_rejected"], after
assert after["samples_outside"] == before["samples_outside"], after
assert gap < 0.060 + 0.020 * missed, gap
PYTHON
