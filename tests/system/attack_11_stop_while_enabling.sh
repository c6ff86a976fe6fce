#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# STOP while the daemon is enabling on a vehicle that is armed: it cancels that, every time. The vehicle stands on the
# ground; a filter on the line makes its heartbeats say that it is armed.
#   attack_11_stop_while_enabling.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
mv "$work/autopilot" "$work/controller"
"$source_dir/tests/system/line_filter.py" "$(readlink "$work/controller")" "$work/autopilot" armed "$work/armed" >>"$log" 2>&1 &
more_pids+=($!)
for _ in $(seq 100); do [[ -e $work/autopilot ]] && break; sleep 0.05; done
start_daemon builtin:quad-5in "$work/flight.bwlog"
sleep 2.5 # the frames are learnt
touch "$work/armed"
sleep 1.2 # its next heartbeat says so
for pause in 100 250 500; do
  "$build/tests/attacker" "$domain" send enable +$pause stop +1800 release >>"$work/answers" || die "no answer"
done
stop
cat "$work/answers" >>"$log"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import sys
import raw_log
work = sys.argv[1]
answers = [line.split(maxsplit=3) for line in open(work + "/answers")]
stops = [float(a[0]) for a in answers if a[1] == "stop" and a[2] == "0"]
assert len(stops) >= 2, answers
ticks = list(raw_log.ticks(work + "/flight.bwlog"))
for stopped in stops:
    missed = max(t.missed for t in ticks if t.t > stopped - 1) * 0.020
    after = {t.mode for t in ticks if stopped + 0.1 + missed < t.t < stopped + 1.7}
    before = {t.mode for t in ticks if stopped - 0.1 < t.t < stopped}
    print(f"before the STOP {sorted(before)}, after it {sorted(after)}")
    assert "enabling" in before, "it was not enabling"
    assert after == {"passive"}, "it went on after an acknowledged STOP"
PYTHON
