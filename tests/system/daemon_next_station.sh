#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A station's next process is heard as soon as the one before has ended, also while nothing else arrives: the bench's odometry
# comes once a second. The same with credentials, where the middleware's own word that a writer is gone may be lost.
#   daemon_next_station.sh SOURCE_DIR BUILD_DIR [encrypt]
set -euo pipefail
source_dir=$1 build=$2 protect=${3:-}
source "$source_dir/services/bench/session.sh"
eyes=()
if [[ -n $protect ]]; then
  keys=$work/keys
  "$build/services/backwash" keys init "$keys" --protect "$protect" >>"$log"
  for role in vehicle vio station; do "$build/services/backwash" keys add "$keys" "$role" --role "$role" >>"$log"; done
  more_dds="security = \"$keys/vehicle\"" ctl_options=(--security "$keys/station") eyes=(--security "$keys/vio")
fi
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --odometry-rate 1 "${eyes[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
for n in $(seq 12); do
  answer=$("$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" hold 2>&1) || true
  echo "$answer" >>"$log"
  [[ $answer != *"session held"* ]] || die "process $n: $answer"
  [[ $answer == *"refused: "* ]] || die "process $n was answered '$answer'"
done
