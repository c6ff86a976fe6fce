#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Another process answers each part of a map in the daemon's name: "it is in use". `backwashctl map` does not believe it, and says
# why; without that process the same map is taken. The daemon is told a map that it refuses: nothing else can say that it is in use.
#   attack_forged_receipt.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
send() { # send CODE PATTERN OPTION …
  local wanted=$1 pattern=$2 code=0
  shift 2
  "$bin/backwashctl" --domain "$domain" map builtin:parallel-walls-4m --patience 5 "$@" >"$work/told" 2>&1 || code=$?
  cat "$work/told"
  [[ $code == "$wanted" ]] && grep -Eq "$pattern" "$work/told" || die "exit $code: $(<"$work/told")"
}
send 69 'refused: .*frame' --frame nowhere
"$build/tests/attacker" "$domain" receipts 8 >"$work/forged" &
forger=$!
more_pids+=("$forger")
sleep 2 # they find each other
send 69 'not known: more than one process writes map_receipt' --frame nowhere
wait "$forger"
cat "$work/forged"
! grep -q '^0 ' "$work/forged" || die "nothing was forged"
send 69 'refused: .*frame' --frame nowhere
