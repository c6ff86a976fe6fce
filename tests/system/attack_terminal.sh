#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The daemon's terminal is attacked while it commands (docs/faults.md row 44): nobody reads its full pipe while a
# participant's messages are refused at 1 kHz, then its signals come, then the pipe is closed. Commands are answered and the
# set-points go on at 50 Hz, judged from the bytes that reached the flight controller.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
now() { python3 -c 'import time; print(time.monotonic())'; }
alive() { kill -0 "$daemon_pid" 2>/dev/null || die "$1 ended the daemon"; }
status() { timeout 10 "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
write_configuration builtin:quad-5in "$work/flight.bwlog"

mkfifo "$work/terminal"
exec 7<>"$work/terminal" # somebody holds it, nobody reads
"${BACKWASHD:-$bin/backwashd}" --config "$work/backwashd.toml" >&7 2>&7 &
daemon_pid=$!
for _ in $(seq 100); do
  status 2>/dev/null && grep -q '"maps_accepted": *1' "$work/status.json" && break
  sleep 0.1
done
enable
python3 - "$work/terminal" <<'PYTHON'
import os, sys
fd = os.open(sys.argv[1], os.O_WRONLY | os.O_NONBLOCK)
try:
    while True:
        os.write(fd, b"." * 4096)
except BlockingIOError:
    pass
PYTHON
from=$(now)
"$build/tests/dds_probe" "$domain" backwash closures &
probe=$!
more_pids+=("$probe")
for _ in 1 2 3; do
  timeout 10 "$bin/backwashctl" --domain "$domain" takeoff --height 9 >>"$log" 2>&1 || true # planned, and refused as unsafe
  sleep 0.3
done
alive 'a stalled terminal'
for signal in HUP PIPE TTOU TTIN TSTP XFSZ USR1 USR2; do
  kill -"$signal" "$daemon_pid"
  sleep 0.1
  alive "SIG$signal"
done
wait "$probe"
status || die 'no status: the daemon is deaf'
exec 7<&- # nobody holds it any more
timeout 10 "$bin/backwashctl" --domain "$domain" takeoff --height 9 >>"$log" 2>&1 || true
sleep 0.5
alive 'a closed terminal'
to=$(now)
timeout 10 "$bin/backwashctl" --domain "$domain" stop --wait >>"$log" 2>&1 || die 'stop was not answered'
kill -TERM "$daemon_pid"
code=0
wait "$daemon_pid" || code=$?
daemon_pid=''
[[ $code == 0 ]] || die "ended with $code"
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$from" "$to" <<'PYTHON'
import json, sys
import raw_log
work, start, end = sys.argv[1], float(sys.argv[2]), float(sys.argv[3])
status = json.load(open(work + "/status.json"))
ticks = [t for t in raw_log.ticks(work + "/flight.bwlog") if start < t.t < end]
wire = [t for t, i, _ in raw_log.wire(work + "/wire.csv") if i == raw_log.SETPOINT and start < t < end]
gap = max(b - a for a, b in zip(wire, wire[1:]))
rate = (len(wire) - 1) / (wire[-1] - wire[0])
missed = sum(t.missed for t in ticks)
print(f"{status['closures_refused']} messages refused; {len(wire)} set-points, {rate:.2f} Hz, largest gap {gap * 1e3:.1f} ms, "
      f"{missed} periods missed")
assert status["closures_refused"] >= 3000, status
assert {t.mode for t in ticks} == {"tracking"}, {t.mode for t in ticks}
assert len(wire) + missed >= (end - start) * 50 - 3, (len(wire), missed, end - start)
assert gap <= 0.060 + 0.020 * max(t.missed for t in ticks), gap
PYTHON
