#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Another process answers each part of a map in the daemon's name: "it is in use". `backwashctl map` does not believe it, and says
# why. Without that process the map is taken.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
printf 'after = "start"\n[[fault]]\nchannel = "map"\nkind = "off"\nfrom = 0\nuntil = 100000\n' >"$work/no_map.toml"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --faults "$work/no_map.toml"
write_configuration builtin:quad-5in "$work/flight.bwlog"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
for _ in $(seq 100); do grep -q 'odometry is taken' "$log" && break; sleep 0.1; done
send() { # send CODE PATTERN
  local code=0
  "$bin/backwashctl" --domain "$domain" map builtin:parallel-walls-4m --patience 5 >"$work/told" 2>&1 || code=$?
  cat "$work/told"
  [[ $code == "$1" ]] && grep -Eq "$2" "$work/told" || die "exit $code: $(<"$work/told")"
}
"$build/tests/attacker" "$domain" receipts 6 >"$work/forged" &
forger=$!
more_pids+=("$forger")
sleep 2 # they find each other
send 69 'not known: more than one process writes map_receipt'
wait "$forger"
cat "$work/forged"
! grep -q '^0 ' "$work/forged" || die "nothing was forged"
send 0 'is in use after'
