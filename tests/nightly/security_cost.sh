#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What DDS Security costs: three vehicles hover side by side in one run, without it, with signed and with encrypted
# packets. Odometry (100 Hz) from its stamp to its reception, and the daemon's processor time.
#   security_cost.sh SOURCE_DIR BUILD_DIR [SECONDS]
set -euo pipefail
source_dir=$1 build=$2 seconds=${3:-60} kind=${4:-all}
if [[ $kind == all ]]; then
  folder=$(mktemp -d) pids=()
  trap 'kill "${pids[@]}" 2>/dev/null || true; rm -rf "$folder"' EXIT
  number=190
  for kind in none sign encrypt; do
    BACKWASH_DOMAIN=$((number++)) "$0" "$source_dir" "$build" "$seconds" "$kind" >"$folder/$kind" &
    pids+=($!)
  done
  for pid in "${pids[@]}"; do wait "$pid"; done
  python3 - "$folder" <<'PYTHON'
import sys
figures = {kind: list(map(float, open(f"{sys.argv[1]}/{kind}").read().split())) for kind in ("none", "sign", "encrypt")}
for kind, (p50, p99, cpu, samples) in figures.items():
    ratios = [a / b for a, b in zip((p50, p99, cpu), figures["none"])]
    print(f"{kind:8} odometry p50 {p50:5.0f} us ({ratios[0]:.2f}), p99 {p99:5.0f} us ({ratios[1]:.2f}); "
          f"daemon {cpu:5.1f} ms of CPU a second ({ratios[2]:.2f}); {samples:.0f} samples")
PYTHON
  exit
fi
source "$source_dir/services/bench/session.sh"
bench=()
if [[ $kind != none ]]; then
  "$build/services/backwash" keys init "$work/keys" --protect "$kind" >>"$log"
  for role in vehicle vio station; do "$build/services/backwash" keys add "$work/keys" "$role" --role "$role" >>"$log"; done
  more_dds="security = \"$work/keys/vehicle\""
  bench=(--security "$work/keys/vio")
  ctl_options=(--security "$work/keys/station")
fi
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in "${bench[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
cpu() { awk '{ print $14 + $15 }' "/proc/$daemon_pid/stat"; }
from=$(python3 -c 'import time; print(time.monotonic())') before=$(cpu)
sleep "$seconds"
to=$(python3 -c 'import time; print(time.monotonic())') after=$(cpu)
stop
PYTHONPATH=$source_dir/tests/system python3 - "$work/flight.bwlog" "$from" "$to" "$((after - before))" "$(getconf CLK_TCK)" <<'PYTHON'
import struct, sys
import raw_log
begin, end, used, per_second = map(float, sys.argv[2:])
ways = sorted(t - struct.unpack_from("<q", body)[0] * 1e-9 for t, kind, body in raw_log.records(sys.argv[1])
              if kind == raw_log.ODOMETRY and begin < t < end)
print(1e6 * ways[len(ways) // 2], 1e6 * ways[len(ways) * 99 // 100], 1e3 * used / per_second / (end - begin), len(ways))
PYTHON
