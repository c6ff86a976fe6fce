#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A real PX4 in the loop of the bench's own simulation: backwash-bench feels for it (HIL_SENSOR, HIL_GPS,
# HIL_STATE_QUATERNION) and turns its airframe's rotors by HIL_ACTUATOR_CONTROLS, in the airflow of builtin:apartment. The
# daemon takes off, hovers, flies through the door and lands on PX4's own MAVLink line.
#   hil.sh PATH_OF_BUILD [BUILD_DIR [OUT_DIR [GOAL]]]
# PATH_OF_BUILD: PX4's build directory, with simulator_mavlink and without lockstep. Exits 77 without one, otherwise with
# the judgement of `backwash report`.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
path=${1:-} build=${2:-$root/build/release} out=${3:-} goal=${4:-7.4,3.0,1.2} name=hil
if [[ -z $path || ! -e $path/bin/px4-simulator_mavlink ]]; then
  echo "skipped: tests/autopilots/hil.sh needs the path of a build of PX4 with simulator_mavlink"
  exit 77
fi
if [[ ${BACKWASH_NETNS:-} != own ]]; then
  BACKWASH_NETNS=own exec unshare -n -- bash "$0" "$path" "$build" "$out" "$goal"
fi
ip link set lo up
source "$root/tests/autopilots/flight.sh"
source "$root/tests/autopilots/simulators.sh"
source "$root/services/bench/configuration.sh"
bin=$build/services domain=7 model=builtin:quad-5in
out=${out:-$work/out}
mkdir -p "$out"
log=$out/hil.log
: >"$log"
vehicle=$root/tests/autopilots/px4.vehicle.toml

"$bin/backwash-bench" --map builtin:apartment --vehicle "$vehicle" --start 3.0,4.2,1.2 --in-loop tcpin:127.0.0.1:4560 \
  --domain "$domain" --log "$out/hil.truth.csv" --force >"$out/hil.bench.log" 2>&1 &
bench_pid=$!
pids+=("$bench_pid")
mapfile -t settings < <(grep -v '^#' "$root/tests/autopilots/hil.params")
model_of_px4=none_iris start_px4 "$path" "${settings[@]}"
kill -0 "$bench_pid" 2>/dev/null || { cat "$out/hil.bench.log" >&2; exit 1; }
daemon "$vehicle" "$out/hil.bwlog"
take_off
sleep 3
must goto "$goal" --wait
sleep 3
must land --wait
kill -TERM "$daemon_pid" "$bench_pid"
wait "$daemon_pid" "$bench_pid" 2>/dev/null || true
cat "$out/hil.bench.log"
"$bin/backwash" report --log "$(sed -n 's/.* raw log //p' "$log" | tail -n 1)" --truth "$out/hil.truth.csv" \
  --vehicle "$vehicle" --model builtin:quad-5in --out "$out/hil.html" --force
