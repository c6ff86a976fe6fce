#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A hostile peer sends damaged copies of its own RTPS packets to daemon, bench and all (docs/faults.md row 47):
# nobody dies, the daemon's memory stays bounded, and afterwards odometry and commands work as before. Secured: they speak
# by DDS Security, and the hostile peer has first no credentials, then those of another authority.
#   daemon_rtps_fuzz.sh SOURCE_DIR BUILD_DIR PACKETS [SEED] [open|secured]
set -euo pipefail
source_dir=$1 build=$2 packets=$3 seed=${4:-1} mode=${5:-open}
# The only peers must be ours: what is damaged goes to every port that is open.
if [[ ${6:-} != inside ]]; then
  source "$source_dir/tests/support/skip.sh"
  own_network "$0" "$source_dir" "$build" "$packets" "$seed" "$mode" inside
fi
source "$source_dir/services/bench/session.sh"
status() { "$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" status --json >"$work/$1.json"; }
resident() { awk '/VmRSS/ { print $2 }' "/proc/$daemon_pid/status"; }
bench=()
if [[ $mode == secured ]]; then
  for keys in "$work/keys" "$work/others"; do "$build/services/backwash" keys init "$keys" >>"$log"; done
  for role in vehicle vio station; do "$build/services/backwash" keys add "$work/keys" "$role" --role "$role" >>"$log"; done
  "$build/services/backwash" keys add "$work/others" outsider --role vio --topic rt/backwash/command >>"$log"
  more_dds="security = \"$work/keys/vehicle\""
  bench=(--security "$work/keys/vio")
  ctl_options=(--security "$work/keys/station")
fi
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --duration 86400 "${bench[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
before=$(resident)
attack() { "$build/tests/rtps_fuzz" "$domain" backwash "$packets" "$seed" "$@" 2>"$work/fuzz" || { tail -n 3 "$work/fuzz"; die "a peer is gone, or met a stranger"; }; }
if [[ $mode == secured ]]; then
  attack outside
  attack outside "$work/others/outsider"
else
  attack
fi
kill -0 "$daemon_pid" || die "the daemon died"
kill -0 "$bench_pid" || die "the bench died"
after=$(resident)
status one
sleep 1
status two
enable
ctl stop --wait
python3 - "$work/one.json" "$work/two.json" "$before" "$after" <<'PYTHON'
import json, sys
one, two = (json.load(open(f)) for f in sys.argv[1:3])
before, after = map(int, sys.argv[3:])
fresh = two["odometry_received"] - one["odometry_received"]
print(f"{two['parts_filtered']} parts filtered; {fresh} odometry samples in the second after; "
      f"resident {before / 1024:.1f} -> {after / 1024:.1f} MiB")
assert two["parts_filtered"] > 0, "nothing was filtered: was anything sent?"
assert fresh > 20 and two["odometry_rejected"] == 0, two
assert after < before + 64 * 1024, "the daemon's memory grows with what strangers send"
PYTHON
