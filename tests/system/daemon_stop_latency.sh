#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From STOP on DDS to the first set-point of the stop on the wire, in flight: N times, to and fro at random moments.
#   daemon_stop_latency.sh SOURCE_DIR BUILD_DIR N [OUT]
# Writes the latencies, ms, one a line, to OUT. tests/nightly/realtime.sh stops has several of these side by side.
# The moment of the STOP is the station's clock right before it writes. Which set-point is the first of the stop says the
# raw log: that of the first tick in mode hold; when it arrived says the bench's record of the wire, by its MAVLink sequence.
set -euo pipefail
source_dir=$1 build=$2 count=$3
source "$source_dir/services/bench/session.sh"
out=${4:-$work/latencies.ms}
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv" \
  --duration "$((count * 20 + 300))"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl --station stops takeoff --height 1.2 --wait
"$build/tests/station_probe" "$domain" backwash stops "$count" 1.8 >"$work/stops" 2>>"$log" || die "not every flight was stopped"
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$count" "$out" <<'PYTHON'
import csv, sys
import raw_log
work, count, out = sys.argv[1], int(sys.argv[2]), sys.argv[3]
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
missed = max(t.missed for t in ticks if t.t > sent[0])
print(f"{count} stops, {missed} periods missed")
open(out, "w").writelines(f"{ms:.3f}\n" for ms in latencies)
PYTHON
