#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# There is no memory left while it commands (docs/faults.md row 50): the set-points end and nothing else follows, the
# flight log is closed with the reason, and the daemon says it and exits with 70.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
# The map comes through the probe: the daemon listens to one writer of maps.
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv" --namespace bench
"$build/tests/dds_probe" "$domain" backwash mapper &
mapper=$!
more_pids+=("$mapper")
start_daemon builtin:quad-5in "$work/flight.bwlog" rt/bench/odometry
enable
sleep 0.5
held() { awk -v what="$1:" '$1 == what {print $2 * 1024}' "/proc/$daemon_pid/status"; }
# Of addresses, and of what may be written: a heap that was reserved before grows without an address more.
prlimit --pid "$daemon_pid" --as="$(held VmSize)" --data="$(held VmData)"
kill -USR1 "$mapper"
wait "$mapper" || die 'dds_probe failed'
code=0
for _ in $(seq 100); do kill -0 "$daemon_pid" 2>/dev/null || break; sleep 0.1; done
kill -0 "$daemon_pid" 2>/dev/null && die 'it goes on without memory'
wait "$daemon_pid" || code=$?
daemon_pid=''
[[ $code == 70 ]] || die "ended with $code instead of 70"
grep '\[critical\] backwashd: .*: .*; nothing more is sent' "$log" || die 'it did not say why'
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import sys
import raw_log
work = sys.argv[1]
records = list(raw_log.records(work + "/flight.bwlog"))
last = max(t.t for t in raw_log.ticks(work + "/flight.bwlog"))
why = raw_log.lines(work + "/flight.bwlog", raw_log.FAILURE)
after = [(t, i) for t, i, _ in raw_log.wire(work + "/wire.csv") if t > last + 0.030]
print(f"flight log ends with: {why[0][1]}; {len(after)} frames after its last tick")
assert len(why) == 1 and records[-1][1] == raw_log.FAILURE, "the flight log was not closed with the reason"
assert not after, after[:3]
PYTHON
