#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The disk does not answer while it commands, neither for the flight log nor for its own lines (docs/faults.md row 35):
# commands are answered and the set-points go on at 50 Hz; what is lost is counted in the status and, once the disk answers,
# in the log; and a disk that hangs does not keep the daemon from ending.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
now() { python3 -c 'import time; print(time.monotonic())'; }
status() { timeout 10 "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json" || { rm -f "$work/hangs"; die 'no status'; }; }
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
cat >"$work/daemon" <<SH
#!/bin/sh
HANG_DISK=$work/hangs LD_PRELOAD=$build/tests/libhang_disk.so exec "${BACKWASHD:-$bin/backwashd}" "\$@"
SH
chmod +x "$work/daemon"
BACKWASHD=$work/daemon start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
from=$(now)
touch "$work/hangs"
sleep 8 # the control thread's ring holds about 7 s
timeout 10 "$bin/backwashctl" --domain "$domain" takeoff --height 9 >>"$log" 2>&1 || true # planned, and refused as unsafe
status
to=$(now)
rm "$work/hangs"
sleep 1
touch "$work/hangs"
kill -TERM "$daemon_pid"
for _ in $(seq 150); do kill -0 "$daemon_pid" 2>/dev/null || break; sleep 0.1; done
rm "$work/hangs"
code=0
wait "$daemon_pid" || code=$?
daemon_pid=''
[[ $code == 74 ]] || die "ended with $code instead of 74"
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$from" "$to" <<'PYTHON'
import json, struct, sys
import raw_log
work, start, end = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
status = json.load(open(work + "/status.json"))
told = [struct.unpack("<Q", body)[0] for _, kind, body in raw_log.records(work + "/flight.bwlog") if kind == raw_log.LOST]
wire = [t for t, i, _ in raw_log.wire(work + "/wire.csv") if i == raw_log.SETPOINT and start < t < end]
gap = max(b - a for a, b in zip(wire, wire[1:]))
print(f"{len(wire)} set-points, {(len(wire) - 1) / (wire[-1] - wire[0]):.2f} Hz, largest gap {gap * 1e3:.1f} ms; "
      f"{status['records_lost']} records lost, {told} told in the log")
missed = status["ticks_missed"]
assert status["state"] == "tracking", status
assert len(wire) + missed >= (end - start) * 50 - 3, (len(wire), missed, end - start)
assert gap <= 0.060 + 0.020 * missed, gap
assert 0 < status["records_lost"] <= told[0], (status["records_lost"], told)
PYTHON
