#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What the daemon's work costs in instructions, as callgrind counts them here, and the time that it would take on a Raspberry Pi 5:
# 2.4 GHz, one instruction a cycle. A Cortex-A76 does one to two; AArch64 and x86-64 need about as many for the same C++.
#   toolchains/cost.sh BUILD        BUILD: a release build, with test_daemon and bench_reach
set -euo pipefail
build=${1:?usage: toolchains/cost.sh BUILD}
command -v valgrind >/dev/null || { echo "cost: needs Debian's valgrind" >&2; exit 69; }
out=$(mktemp)
trap 'rm -f "$out"' EXIT

# cost NAME FUNCTION COMMAND …: instructions in FUNCTION and in what it calls, a call.
cost() {
  local name=$1 function=$2
  shift 2
  valgrind -q --tool=callgrind --callgrind-out-file="$out" --toggle-collect="$function*" "$@" >/dev/null 2>&1
  callgrind_annotate --inclusive=yes --tree=calling --threshold=100 "$out" | NAME=$name FUNCTION=$function awk '
    index($0, ENVIRON["FUNCTION"]) && / > / {
      if (match($0, /\([0-9,]+x\)/)) { n = substr($0, RSTART + 1, RLENGTH - 3); gsub(",", "", n); calls += n
        ir = $1; gsub(",", "", ir); all += ir } }
    END { if (!calls) exit 1; printf "%-34s %7d calls %14.0f instructions %10.3f ms\n", ENVIRON["NAME"], calls, all / calls, all / calls / 2.4e6 }'
}

# A flight through the narrow gap and back: control thread, planner and map worker in lockstep.
flight=("$build/tests/test_daemon" "--gtest_filter=AirFlights.AFlightWhoseWay*")
cost "control thread's tick" "backwash::daemon::ControlLoop::tick(" "${flight[@]}"
cost "  its decision" "backwash::track::FlightTick::step(" "${flight[@]}"
cost "tube of 100 set-points" "backwash::reach::tube_over_field(" "$build/tests/bench/bench_reach" \
  --benchmark_filter=tube_100_apartment_vehicle --benchmark_min_time=0.01
cost "plan, narrow gap" "backwash::plan::plan(" "${flight[@]}"
cost "hover map, one region" "backwash::reach::HoverMap::fill(" "${flight[@]}"
cost "whole world, narrow gap" "backwash::plan::build_world(" "${flight[@]}"
