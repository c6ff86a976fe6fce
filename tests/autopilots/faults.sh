#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a flight of the daemon with a real autopilot does when something goes wrong at speed: one flight a fault.
#   faults.sh ardupilot|px4 PATH_OF_BUILD BUILD_DIR OUT_DIR [FAULT …]
# Prints a row a fault: how far the vehicle went after it, when it was at rest, when disarmed, contacts, and what the daemon
# said. Exits 77 without a build to fly, 1 if a vehicle touched the map, moved on, or a fault was not survived as docs/faults.md
# says.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
kind=$1 path=$2 build=$3 out=$4
shift 4
all=(hold stop land vio_stop vio_freeze vio_jump vio_turn sigstop kill pilot)
[[ $# -gt 0 ]] || set -- "${all[@]}"
if [[ ! -e $path ]]; then
  echo "skipped: tests/autopilots/faults.sh needs the path of a build of $kind"
  exit 77
fi

if [[ $# -gt 1 ]]; then
  failed=0
  for fault; do bash "$0" "$kind" "$path" "$build" "$out" "$fault" || failed=1; done
  exit "$failed"
fi
fault=$1
# fly_real begins anew in a network namespace: with these arguments, in its order.
if [[ ${BACKWASH_NETNS:-} != own ]]; then
  BACKWASH_NETNS=own exec unshare -n -- bash "$0" "$kind" "$path" "$build" "$out" "$fault"
fi
source "$root/tests/autopilots/flight.sh"
# The pilot's switch brings a mode that holds the position: ArduCopter's sixth (LOITER).
[[ $kind != ardupilot ]] || SETTINGS=${SETTINGS:-FLTMODE6=5}
fly_real "$kind" "$path" "$build" "$out/$fault"
take_off

state() { "$bin/backwashctl" --domain "$domain" status --json 2>>"$log"; }
read_state() { python3 -c 'import json, sys; s = json.load(sys.stdin); print(s["state"], s["position"][0])'; }
must goto "$goal"
# At speed, before the door.
for _ in $(seq 100); do
  read -r mode x < <(state | read_state)
  python3 -c "import sys; sys.exit(not $x > 4.0)" && break
  sleep 0.05
done
[[ $mode == tracking ]] || die "the flight was in $mode before the fault"
at=$(python3 -c "import time; print(time.monotonic())")
from=$(wc -l <"$log")
case $fault in
  hold | stop | land) must "$fault" --wait ;;
  vio_*) echo "$(sed 's/^vio_//; s/^jump$/jump 1 0.5 0/; s/^turn$/turn 1.57/' <<<"$fault")" >&7 ;;
  sigstop) kill -STOP "$autopilot_pid" && sleep 3 && kill -CONT "$autopilot_pid" ;;
  kill)
    kill -KILL "$daemon_pid"
    sleep 3
    daemon "$vehicle" "$out/again.bwlog"
    ;;
  pilot)
    if [[ $kind == px4 ]]; then
      "$path/bin/px4-commander" mode auto:loiter >>"$log" 2>&1
    else
      echo 1900 >"$work/switch"
    fi
    ;;
  *) die "no fault $fault: ${all[*]}" ;;
esac
sleep 15
kill -TERM "$daemon_pid" "$vio_pid" 2>/dev/null || true
wait "$daemon_pid" "$vio_pid" 2>/dev/null || true
said=$(tail -n +"$((from + 1))" "$log" | sed -n 's/.*\[info\] \(\(passive\|hold\|land\|quiet\|tracking\): .*\)/\1/p' | paste -sd ';')
python3 "$root/tests/autopilots/run_out.py" "$kind" "$fault" "$out/$kind.truth.csv" "$at" \
  "$(sed -n 's/.* contacts \([0-9]*\),.*/\1/p' "$out/$kind.vio.log" | tail -n 1)" "$said"
