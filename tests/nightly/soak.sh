#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Flies to and fro between two places for a given time, each leg planned anew.
#   soak.sh BUILD_DIR OUT_DIR SECONDS
# Writes OUT_DIR/soak.rss (the daemon's resident memory each second, kB; with locked memory that is all it has mapped) and
# OUT_DIR/soak.{log,bwlog}. Fails if a tenth of the legs was not flown, or fewer than one in 20 s.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../../services/bench/session.sh"
build=$1 out=$2 seconds=$3
: >"$out/soak.log"
start_bench "$build/services" "$out/soak.log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --duration "$((seconds + 120))"
rm -f "$out/soak.bwlog" # of an earlier run; the daemon itself would leave it and take the next name
start_daemon builtin:quad-5in "$out/soak.bwlog"
enable
ctl takeoff --height 1.2 --wait
(
  trap - EXIT
  for _ in $(seq "$seconds"); do
    awk '/^VmRSS/ { print $2 }' "/proc/$daemon_pid/status" 2>/dev/null || break
    sleep 1
  done >"$out/soak.rss"
) &
sampler=$!
flown=0 lost=0
# A leg that is not flown (the bench was kept from the processor: odometry lost) costs a landing and a new take-off.
while kill -0 "$sampler" 2>/dev/null; do
  goal=$((flown % 2 == 0 ? 2 : -2)),0,1.2
  if (trap - EXIT; ctl goto "$goal" --wait) >>"$log" 2>&1; then
    flown=$((flown + 1))
  else
    lost=$((lost + 1))
    sleep 8
    enable
    ctl takeoff --height 1.2 --wait
  fi
done
wait "$sampler"
stop
echo "$flown legs flown, $lost not"
((flown >= 10 * lost && flown * 20 >= seconds))
