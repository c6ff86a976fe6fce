#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# One flight through the daemon, judged afterwards from its raw log.
#   flight.sh BUILD_DIR OUT_DIR NAME MAP START GOAL [VEHICLE [SEED [AUTOPILOT [BENCH_OPTION …]]]]
# AUTOPILOT: simple, ardupilot or px4, with what the daemon wants of the last two set.
# $model: the model of daemon and report, if it is not the vehicle's own.
# Writes OUT_DIR/NAME.{html,bwlog,truth.csv,wire.csv,status.json,log}; exits with the code of `backwash report`. A flight
# that could not be flown to its end exits with 70, and has its page too, the reason first.
set -euo pipefail
mkdir -p "$2"
out=$(cd "$2" && pwd)
source "$(dirname "${BASH_SOURCE[0]}")/session.sh"
build=$1 name=$3 map=$4 start=$5 goal=$6 vehicle=${7:-builtin:quad-5in} seed=${8:-1} autopilot=${9:-simple}
shift $(($# < 9 ? $# : 9))
# judge OPTION …: the page of what was recorded.
judge() {
  "$bin/backwash" report --log "$out/$name.bwlog" --truth "$out/$name.truth.csv" --vehicle "$vehicle" \
    --model "${model:-$vehicle}" --out "$out/$name.html" --force --quiet "$@"
}
die() {
  echo "flight: $*; see $log" >&2
  stop
  if [[ -s $out/$name.bwlog ]]; then
    judge --because "$*" >>"$log" 2>&1 || true
    [[ -s $out/$name.html ]] && echo "flight: what was recorded: $out/$name.html" >&2
  fi
  exit 70
}
# Of an earlier run: the daemon itself would leave the log and take the next name.
rm -f "$out/$name.html" "$out/$name.bwlog"
case $autopilot in # as tests/autopilots/{ardupilot.parm,px4.params} set the real ones
  ardupilot) settings=(GUID_TIMEOUT=0.3 WPNAV_ACCEL_Z=250 PSC_JERK_Z=20 PSC_JERK_XY=20) ;;
  px4) settings=(COM_OF_LOSS_T=0.3 COM_OBL_RC_ACT=4) ;;
  *) settings=() ;;
esac
: >"$out/$name.log"

start_bench "$build/services" "$out/$name.log" "$map" "$start" "$vehicle" --seed "$seed" --log "$out/$name.truth.csv" \
  --wire "$out/$name.wire.csv" --autopilot "$autopilot" "${settings[@]/#/--parameter=}" "$@"
start_daemon "$vehicle" "$out/$name.bwlog"
enable
ctl takeoff --height "${start##*,}" --wait
ctl goto "$goal" --wait
sleep 3 # hold at the goal
"$bin/backwashctl" --domain "$domain" status --json >"$out/$name.status.json" 2>>"$log" || die "no status at the goal"
ctl land --wait
stop
judge
