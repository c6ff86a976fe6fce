#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A flight in which every thread of the daemon has work: an obstacle is scanned on the path, a loop closure moves the map, a
# participant floods the odometry topic at 10 kHz, a ground station sends commands; then the daemon is asked to stop.
#   tsan_flight.sh BUILD_DIR OUT_DIR        (BACKWASHD: the daemon that flies)
# Exits with the daemon's own code, which must be 0 (66: ThreadSanitizer has reported); 70 if that is 0 and the flight did
# not take place.
# Real-time goals are not judged: a slow build may hold, land or refuse, but it may not race.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../services/bench/session.sh"
build=$1 out=$2
: >"$out/tsan.log"
start_bench "$build/services" "$out/tsan.log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --crate 1.3,0,1.2 \
  --crate-edge 0.4 --drift 0,0.15,0 --event-x -0.8
rm -f "$out/tsan.bwlog" # of an earlier run; the daemon itself would leave it and take the next name
start_daemon builtin:quad-5in "$out/tsan.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$build/tests/dds_probe" "$domain" backwash flood &
flood=$!
ctl goto 2,0,1.2
wait "$flood"
# Each command is answered; what the answer is depends on how slow the build is.
for command in hold "goto 0,0,1.2" status stop land; do
  "$bin/backwashctl" --domain "$domain" $command >>"$log" 2>&1 || true
  sleep 1
done
# The map worker has the lowest priority: wait for it to have built at least one snapshot from scans.
for _ in $(seq 60); do
  "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json" 2>>"$log" || true
  grep -Eq '"scans_accepted": ?[1-9]' "$work/status.json" && break
  sleep 1
done
sleep 3
status=0
kill -TERM "$daemon_pid"
wait "$daemon_pid" || status=$?
daemon_pid=''
echo "the daemon's exit code: $status"
[[ $status == 0 ]] || exit "$status"
PYTHONPATH=$(dirname "${BASH_SOURCE[0]}")/../system python3 - "$out/tsan.bwlog" <<'PYTHON' || exit 70
import collections, sys
import raw_log
log = sys.argv[1]
ticks = list(raw_log.ticks(log))
kinds = collections.Counter(kind for _, kind, _ in raw_log.records(log))
worlds, scans = kinds[raw_log.WORLD], kinds[raw_log.SCAN]
modes = collections.Counter(t.mode for t in ticks)
print(f"{len(ticks)} ticks ({dict(modes)}), {kinds[raw_log.ODOMETRY]} samples, {scans} scans, {worlds} snapshots, "
      f"{len({t.segment for t in ticks}) - 1} segments, {sum(t.missed for t in ticks)} periods missed")
assert modes["tracking"] > 300 and scans > 20 and worlds > 1, "the flight did not take place"
PYTHON
