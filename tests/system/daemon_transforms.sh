#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# dds.tf, as a tf2 listener of another middleware reads rt/tf: nothing unless it is asked for; "map" sends where a loop
# closure has the estimator's frame, "vehicle" the body too, in the frame that it was told in, and not once it is not told.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --namespace elsewhere
# shown TF SENT [FOUND]: the transforms that a daemon with dds.tf = TF sends while that is sent, in $work/seen. They find each other in
# their own time: a heartbeat of Fast DDS's that comes before its writer is known is followed by the next after 3 s. FOUND s are waited
# for the first transform; for none, which says something only once the daemon has taken the odometry.
shown() {
  local from=$(wc -l <"$log")
  more_dds="tf = \"$1\""
  write_configuration builtin:quad-5in "$work/$1-$2.bwlog"
  "$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
  daemon_pid=$!
  "$build/tests/fastdds_transforms" "$domain" "$2" 4 "${3:-30}" >"$work/seen" || die "no listener"
  kill -TERM "$daemon_pid"
  wait "$daemon_pid" || die "the daemon ended by itself"
  daemon_pid=''
  [[ $(tail -n +"$((from + 1))" "$log") == *'odometry is taken from writer'* ]] || die "no odometry was taken"
  sed "s/^/$1, $2: /" "$work/seen"
}
# sent NAME PLACE: at this place, while odometry came at 5 to 10.5 a second (10).
sent() {
  python3 - "$work/seen" "$1" "$2" "$3" <<'PYTHON' || die "$1 is not $2, $3: $(<"$work/seen")"
import re, sys
lines = dict(line.rstrip().split(": ", 1) for line in open(sys.argv[1]))
place, rate, after, newest, oldest = re.fullmatch(r"(.*), ([\d.]+) a second, (\d+) after it, (\S+) to (\S+) s old", lines[sys.argv[2]]).groups()
assert place == sys.argv[3] and 5 <= float(rate) <= 10.5, (place, rate)
assert (int(after) > 10) == (sys.argv[4] == "goes on") and int(after) <= (25 if sys.argv[4] == "goes on" else 3), after
assert -0.05 <= float(newest) and float(oldest) < 0.5, (newest, oldest)
PYTHON
}
only() { [[ $(wc -l <"$work/seen") == "$1" ]] || die "not $1 transforms: $(<"$work/seen")"; }

shown none odom 10
only 0
shown map odom
sent 'map > odom' '-2.000 0.500 0.250 yaw 2.000' 'goes on'
only 1
shown map map 10 # its frame's place in the map is told by nobody
only 0
shown vehicle odom
sent 'map > odom' '-2.000 0.500 0.250 yaw 2.000' 'goes on'
sent 'odom > base_link' '1.000 2.000 0.160 yaw 0.500' ends
only 2
shown vehicle map
sent 'map > base_link' '1.000 2.000 0.160 yaw 0.500' ends
only 1
