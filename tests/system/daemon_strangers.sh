#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Participants that do not exist are announced in a flight (docs/faults.md row 26; strangers.py says which): the flight goes
# on, the daemon's memory grows by 8 MiB at most, a station that is started meanwhile is heard, and what was known before stays.
# Whoever announced them keeps its ports until the end: a station that got one would be taken for it.
#   daemon_strangers.sh SOURCE_DIR BUILD_DIR COUNT RATE [open|secured] [HOW …]     COUNT announcements of each HOW, RATE a second
set -euo pipefail
source_dir=$1 build=$2 count=$3 rate=$4 mode=${5:-open}
hows=("${@:6}")
[[ ${#hows[@]} -gt 0 ]] || hows=(new many again dependent forwarded endpoints dispose)
source "$source_dir/services/bench/session.sh"
bench=()
if [[ $mode == secured ]]; then
  "$build/services/backwash" keys init "$work/keys" >>"$log"
  for role in vehicle vio station; do "$build/services/backwash" keys add "$work/keys" "$role" --role "$role" >>"$log"; done
  more_dds="security = \"$work/keys/vehicle\""
  bench=(--security "$work/keys/vio")
  ctl_options=(--security "$work/keys/station")
fi
status() { "$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" --timeout 30 status --json >"$work/status" 2>>"$log" || die "$how: no status"; }
value() { python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))[sys.argv[2]])' "$work/status" "$1"; }
resident() { awk '/VmRSS/ { print $2 }' "/proc/$daemon_pid/status"; }
bound() { grep -c 'odometry is taken from writer' "$log"; }
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --duration 86400 "${bench[@]}"
start_daemon builtin:quad-5in "$work/flight.bwlog"
how=before
enable
ctl takeoff --height 1.2 --wait
status
missed=$(value ticks_missed) writers=$(bound)
eyes=$(sed -n 's/.*odometry is taken from writer //p' "$log" | tail -n 1)
for how in "${hows[@]}"; do
  options=(1 "$how")
  [[ $how != many ]] || options=(500)
  [[ $how != dispose ]] || options+=("$eyes")
  before=$(resident)
  : >"$work/took"
  python3 "$source_dir/tests/system/strangers.py" "$domain" "$count" "$rate" "${options[@]}" >"$work/took" &
  more_pids+=($!)
  for _ in $(seq 300); do [[ ! -s $work/took ]] || break; sleep 0.1; done
  sleep 0.5
  begun=$EPOCHREALTIME
  status
  joined=$EPOCHREALTIME
  for _ in $(seq 600); do
    [[ $(wc -l <"$work/took") -lt 2 ]] || break
    kill -0 "${more_pids[-1]}" 2>/dev/null || { code=0; wait "${more_pids[-1]}" || code=$?; die "$how: strangers.py ended with $code"; }
    sleep 0.1
  done
  [[ $(wc -l <"$work/took") == 2 ]] || die "$how: strangers.py was not done in a minute"
  during=$(resident)
  status
  python3 - "$mode $how" "$work/took" "$before" "$during" "$begun" "$joined" "$(value state)" "$(value ticks_missed)" "$missed" "$(value parts_filtered)" <<'PYTHON' || die "$mode, $how"
import sys
what, took, before, during, begun, joined, state, missed, missed_before, filtered = sys.argv[1:]
grown = (int(during) - int(before)) / 1024
print(f"{what}: {open(took).read().split()[-1]} s, resident {grown:+.1f} MiB, a station's first status after {float(joined) - float(begun):.1f} s, "
      f"{state}, {int(missed) - int(missed_before)} ticks missed, {filtered} parts filtered")
assert state == "tracking", state
assert grown <= 8, grown
PYTHON
  [[ $(bound) == "$writers" ]] || die "$how: the odometry's writer was lost"
done
ctl goto 0,0,1.2 --wait
ctl land --wait
