#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Flights on odometry of many rates and latencies through the real processes (docs/model.md 4-13 to 4-15), and a table of what each
# costs in clearance. Of each flight the raw log is decided again, bit for bit.
#   slow_odometry.sh [BUILD_DIR [OUT_DIR [NAME …]]]       no NAME: all; BACKWASH_REPLAY: another build's `backwash` that replays too
# Exit 1 unless every flight reaches its goal, touches nothing, has every sample inside and replays.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
build=$(cd "${1:-$source_dir/build/release}" && pwd) out=${2:-$source_dir/build/slow_odometry}
shift $(($# < 2 ? $# : 2))
mkdir -p "$out"

# name, Hz, latency s, jitter s, [odometry]
flights=(
  "200hz 200 0 0 "
  "100hz 100 0 0 "
  "30hz 30 0 0 "
  "20hz 20 0 0 rate_least=18"
  "10hz 10 0 0 rate_least=9"
  "10hz_jitter 10 0 0.02 rate_least=9"
  "30hz_40ms 30 0.04 0.01 latency=0.04"
  "30hz_120ms 30 0.12 0.01 latency=0.12"
  "10hz_40ms 10 0.04 0.01 rate_least=9,latency=0.04"
  "10hz_120ms 10 0.12 0.01 rate_least=9,latency=0.12"
)

failed=0
for flight in "${flights[@]}"; do
  read -r name rate latency jitter keys <<<"$flight"
  [[ $# == 0 || " $* " == *" $name "* ]] || continue
  export more_tables=$'[odometry]\n'${keys//,/$'\n'}
  "$source_dir/services/bench/flight.sh" "$build" "$out" "$name" builtin:parallel-walls-4m -2,0,1.2 2,0,1.2 builtin:quad-5in 1 simple \
    --odometry-rate "$rate" --odometry-latency "$latency" --odometry-jitter "$jitter" >"$out/$name.report" 2>&1 || failed=1
  "$build/services/backwash" report --log "$out/$name.bwlog" --truth "$out/$name.truth.csv" --json >"$out/$name.json" || failed=1
  "$build/services/backwash" replay --log "$out/$name.bwlog" --json >"$out/$name.replay" || failed=1
  [[ -z ${BACKWASH_REPLAY:-} || -n $keys ]] || "$BACKWASH_REPLAY" replay --log "$out/$name.bwlog" || failed=1
done
python3 "$source_dir/tests/nightly/slow_odometry.py" "$out" || failed=1
exit $failed
