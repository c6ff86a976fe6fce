#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A station's next process is heard as soon as the one before has ended, also while nothing else arrives: the bench's odometry
# comes once a second.
#   daemon_next_station.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --odometry-rate 1
start_daemon builtin:quad-5in "$work/flight.bwlog"
for n in $(seq 12); do
  answer=$("$bin/backwashctl" --domain "$domain" enable 2>&1) || true
  echo "$answer" >>"$log"
  [[ $answer != *"session held"* ]] || die "process $n: $answer"
  [[ $answer == *"refused: "* ]] || die "process $n was answered '$answer'"
done
