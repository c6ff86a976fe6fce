#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A participant floods the odometry topic at 10 kHz (docs/faults.md row 26). The control thread's wake-up and tick
# times during the flood against those before it, in one run; at most 1.5 times as long.
#   daemon_flood.sh SOURCE_DIR BUILD_DIR [SECONDS]      nightly 10; with fewer only the median is judged: 5 % of them are
#                                                       what else shared processors do
set -euo pipefail
source_dir=$1 build=$2 seconds=${3:-10}
source "$source_dir/services/bench/session.sh"
now() { python3 -c 'import time; print(time.monotonic())'; }
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
from=$(now)
sleep "$seconds"
flood=$(now)
"$build/tests/dds_probe" "$domain" backwash flood "$seconds"
end=$(now)
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work/flight.bwlog" "$from" "$flood" "$end" "$seconds" <<'PYTHON'
import sys
import raw_log
start, flood, end, seconds = map(float, sys.argv[2:])
ticks = list(raw_log.ticks(sys.argv[1]))
quantile = lambda values, q: sorted(values)[int(q * (len(values) - 1))]
good = True
for name in ("compute_us", "lateness_us"):
    before = [getattr(t, name) for t in ticks if start < t.t < flood]
    during = [getattr(t, name) for t in ticks if flood + 0.5 < t.t < end]
    # The median and p95: of 500 ticks the p99 rests on five.
    for q in (0.5, 0.95):
        a, b = quantile(before, q), quantile(during, q)
        print(f"{name} p{100 * q:.0f}: {a:.0f} us before, {b:.0f} us during the flood, ratio {b / a:.2f}")
        # Half a hundredth of the period: what a scheduler adds to a few microseconds of lateness is no slowness.
        good = good and (b / a <= 1.5 or b - a < 100 or q > 0.5 and seconds < 10)
assert len(during) > 40 * (seconds - 1), "the flood was too short"
assert {t.mode for t in ticks if flood < t.t < end} == {"tracking"}
assert good, "the flood slows the control thread"
PYTHON
