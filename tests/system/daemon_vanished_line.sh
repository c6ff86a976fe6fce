#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# SIGTERM after the network interface of DDS has vanished (docs/faults.md, "The daemon and its computer"): libddsc 0.10.2 waits
# for its own threads without end, and the daemon is gone within 2 s all the same, its raw log whole and its last lines said.
#   daemon_vanished_line.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
if [[ ${3:-} != inside ]]; then
  source "$source_dir/tests/support/skip.sh"
  own_network tun "$0" "$source_dir" "$build" inside
fi
source "$source_dir/services/bench/session.sh"
unset CYCLONEDDS_URI
bin=$build/services

# begin: a daemon on tun0, with a station that watches it and its autopilot on a pseudo-terminal.
begin() {
  ip tuntap add dev tun0 mode tun
  ip address add 10.9.0.2/24 dev tun0
  ip link set tun0 up multicast on
  start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --interface tun0
  interface=tun0 start_daemon builtin:quad-5in "$work/$1.bwlog"
  "$bin/backwashctl" --domain "$domain" --interface tun0 status >>"$log"
}
# end_daemon NAME: asks it to end, and says how long that took.
end_daemon() {
  local begun=$(date +%s%3N) code=0 took
  kill -TERM "$daemon_pid"
  for _ in $(seq 100); do kill -0 "$daemon_pid" 2>/dev/null && sleep 0.05 || break; done
  took=$(($(date +%s%3N) - begun))
  ! kill -0 "$daemon_pid" 2>/dev/null || kill -KILL "$daemon_pid"
  wait "$daemon_pid" || code=$?
  daemon_pid=''
  echo "$1: gone after $took ms, exit code $code"
  [[ $code == 0 && $took -lt 2000 ]] || die "$1: gone after $took ms, exit code $code"
  grep -q 'stopped' "$log" || die "$1: it has not said that it stopped"
  # A header and whole records to its end, of which the last ticks are from the time of the signal.
  PYTHONPATH=$source_dir/tests/system python3 - "$work/$1.bwlog" "$begun" <<'PYTHON' || die "$1: its raw log is not whole"
import os, sys, time
import raw_log
last = max(t.t for t in raw_log.ticks(sys.argv[1]))
asked = int(sys.argv[2]) * 1e-3 - (time.time() - time.monotonic())
assert abs(last - asked) < 0.2, last - asked
PYTHON
  "$bin/backwash" replay --log "$work/$1.bwlog" >>"$log" 2>&1 || die "$1: its raw log cannot be decided again"
}

begin there
end_daemon there
! grep -q 'the middleware does not end' "$log" || die "it says that a middleware hangs which does not"
stop
ip link delete tun0
begin vanished
ip link delete tun0
sleep 1
end_daemon vanished
grep -q 'the middleware does not end.*left behind' "$log" || die "it does not say that the middleware hangs"
# Its own process does not end in order either.
kill -KILL "$bench_pid"
