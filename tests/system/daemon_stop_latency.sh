#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From STOP on DDS to the first set-point of the stop on the wire, in flight: N times, to and fro at random moments.
#   daemon_stop_latency.sh SOURCE_DIR BUILD_DIR N [load]      load: beside stress-ng on two processors
# The moment of the STOP is the station's clock right before it writes. Which set-point is the first of the stop says the
# raw log: that of the first tick in mode hold; when it arrived says the bench's record of the wire, by its MAVLink sequence.
set -euo pipefail
source_dir=$1 build=$2 count=$3
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl --station stops takeoff --height 1.2 --wait
if [[ ${4:-} == load ]]; then
  stress-ng --cpu 2 --timeout 3600 >/dev/null 2>&1 &
  more_pids+=($!)
fi
"$build/tests/station_probe" "$domain" backwash stops "$count" 1.8 >"$work/stops" 2>>"$log" || die "not every flight was stopped"
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$count" <<'PYTHON'
import csv, sys
import raw_log
work, count = sys.argv[1], int(sys.argv[2])
sent = [float(line) for line in open(work + "/stops")]
assert len(sent) == count, len(sent)
ticks = list(raw_log.ticks(work + "/flight.bwlog"))
frames = [(t, body[4]) for t, kind, body in raw_log.records(work + "/flight.bwlog")
          if kind == raw_log.FRAME_OUT and raw_log.message_id(body) == raw_log.SETPOINT]
wire = [(float(r["t_s"]), int(r["sequence"])) for r in csv.DictReader(open(work + "/wire.csv"))
        if r["id"] == str(raw_log.SETPOINT)]
latencies = []
for t in sent:
    hold = next(b for a, b in zip(ticks, ticks[1:]) if b.t > t and b.mode == "hold" and a.mode != "hold")
    sequence = min((f for f in frames if abs(f[0] - hold.t) < 0.015), key=lambda f: abs(f[0] - hold.t))[1]
    arrived = next(w for w, s in wire if w > t and s == sequence)
    latencies.append((arrived - t) * 1e3)
latencies.sort()
quantile = lambda q: latencies[min(count - 1, int(q * count))]
missed = max(t.missed for t in ticks if t.t > sent[0])
print(f"{count} stops: p50 {quantile(0.5):.1f}, p99 {quantile(0.99):.1f}, max {latencies[-1]:.1f} ms; {missed} periods missed")
# Reader, then the mission's 5 ms, then up to one tick, then the line.
assert quantile(0.5) < 40, "a STOP waits for more than the next tick"
PYTHON
