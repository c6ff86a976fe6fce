#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A take-off that was cancelled before it was flown, then enable (../../shared/faults.md row 40): the motors never start.
#   attack_02_cancelled_takeoff_arms.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl release
steps=()
# On the ground, disarmed, stop is disable.
for pause in 0 10 25; do steps+=(takeoff=0,0,1.2 +$pause stop +400 enable +2000); done
"$build/tests/attacker" "$domain" send "${steps[@]}" >"$work/answers" || die "no answer"
stop
cat "$work/answers" >>"$log"
[[ $(grep -c '^[0-9.]* stop 0' "$work/answers") == 3 ]] || die "a stop was not accepted"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import csv, struct, sys
import raw_log
work = sys.argv[1]
sent = [body for _, kind, body in raw_log.records(work + "/flight.bwlog") if kind == raw_log.FRAME_OUT]
commands = [struct.unpack_from("<H", b[10:] + bytes(40), 28)[0] for b in sent if raw_log.message_id(b) == raw_log.COMMAND]
armed = sum(r["armed"] == "1" for r in csv.DictReader(open(work + "/truth.csv")))
print(f"{len(commands)} commands to the autopilot, {commands.count(400)} of them to arm; armed for {armed * 0.02:.2f} s")
assert 176 in commands, "it never took control"
assert 400 not in commands and armed == 0, "a cancelled take-off armed the vehicle"
PYTHON
