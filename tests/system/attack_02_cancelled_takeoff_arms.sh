#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A take-off that was cancelled before it was flown, then enable (docs/faults.md row 40): the motors start for no plan of
# before the STOP: at most for one that was accepted and armed for by then.
#   attack_02_cancelled_takeoff_arms.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl release
steps=()
# On the ground, disarmed, stop is disable. A planner that was faster than the STOP has armed: then it lands for 3 s first.
for pause in 0 10 25; do steps+=(takeoff=0,0,1.2 +$pause stop +4000 enable +2000); done
"$build/tests/attacker" "$domain" send "${steps[@]}" >"$work/answers" || die "no answer"
stop
cat "$work/answers" >>"$log"
[[ $(grep -c '^[0-9.]* stop 0' "$work/answers") == 3 ]] || die "a stop was not accepted"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import csv, struct, sys
import raw_log
work = sys.argv[1]
answers = [line.split(maxsplit=3) for line in open(work + "/answers")]
sent = [(t, body[10:] + bytes(40)) for t, kind, body in raw_log.records(work + "/flight.bwlog")
        if kind == raw_log.FRAME_OUT and raw_log.message_id(body) == raw_log.COMMAND]
commands = [(t, struct.unpack_from("<H", p, 28)[0], struct.unpack_from("<f", p, 0)[0]) for t, p in sent]
arms = [t for t, command, first in commands if command == 400 and first == 1]
late = [t for t in arms if [a[1] for a in answers if float(a[0]) < t][-1:] == ["stop"]]
armed = sum(r["armed"] == "1" for r in csv.DictReader(open(work + "/truth.csv")))
print(f"{len(commands)} commands to the autopilot, {len(arms)} of them to arm, {len(late)} after a STOP; "
      f"armed for {armed * 0.02:.2f} s")
assert 176 in [command for _, command, _ in commands], "it never took control"
assert not late and (arms or armed == 0), "a cancelled take-off armed the vehicle"
PYTHON
