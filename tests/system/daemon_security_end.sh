#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The daemon's own certificate ends in flight (docs/faults.md row 29): the middleware takes its participants away at that
# second, and the flight ends as one whose odometry is lost: HOLD, LAND, on the ground. It was told at the start.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
credentials() { "$build/services/backwash" keys "$@" >>"$log"; }
credentials init "$work/keys"
credentials add "$work/keys" eyes --role vio
credentials add "$work/keys" pilot --role station
end=$(($(date +%s) + 40))
credentials add "$work/keys" drone --role vehicle --until "$(date -u -d "@$end" +%Y-%m-%dT%H:%M:%SZ)"
more_dds="security = \"$work/keys/drone\"" ctl_options=(--security "$work/keys/pilot")
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv" --security "$work/keys/eyes"
start_daemon builtin:quad-5in "$work/flight.bwlog"
grep -q 'its certificate ends in 0 days and 0 h' "$log" || die 'the end of the certificate was not told'
enable
ctl takeoff --height 1.2 --wait
(($(date +%s) < end - 2)) || die 'this machine was too slow: the certificate ended before the flight began'
sleep $((end - $(date +%s) + 8))
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" "$end" <<'PYTHON'
import csv, sys, time
import raw_log
work, end = sys.argv[1], float(sys.argv[2]) - time.time() + time.monotonic()
last = max(raw_log.times(work + "/flight.bwlog", raw_log.ODOMETRY))
ticks = [t for t in raw_log.ticks(work + "/flight.bwlog") if t.t > last - 1]
missed = max(t.missed for t in ticks) * 0.020
hold, land = (next(t.t for t in ticks if t.mode == mode) for mode in ("hold", "land"))
truth = list(csv.DictReader(open(work + "/truth.csv")))
print(f"last odometry {last - end:+.2f} s from the certificate's end, HOLD {hold - last:.3f} s later, LAND {land - last:.3f} s")
assert -0.5 < last - end < 1.5, "the odometry did not end with the certificate"
assert hold - last <= 0.100 + missed and land - last <= 0.400 + missed
assert any(r["armed"] == "1" for r in truth) and truth[-1]["armed"] == "0", "the vehicle is not on the ground"
PYTHON
