#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# STOP while a plan is under way (docs/faults.md row 39): goto, and STOP so many milliseconds later, from one station.
# Once the STOP is acknowledged no set-point moves but on the verified stop that was under way, until a later command.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
ctl release
goals=(2,0,1.2 -2,0.8,1.2)
for pause in 0 40 120; do
  "$build/tests/attacker" "$domain" send "goto=${goals[0]}" +$pause stop +2500 release >>"$work/answers" || die "no answer"
  goals=("${goals[1]}" "${goals[0]}")
done
stop
cat "$work/answers" >>"$log"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import csv, math, sys
work = sys.argv[1]
answers = [line.split(maxsplit=3) for line in open(work + "/answers")]
stops = [float(a[0]) for a in answers if a[1] == "stop" and a[2] == "0"]
assert len(stops) == 3, answers
assert any(a[1] == "goto" and a[2] == "0" for a in answers), "no flight was ever asked for"
rows = [r for r in csv.DictReader(open(work + "/wire.csv")) if r["id"] == "84"]
for stopped in stops:
    after = [(float(r["t_s"]), [float(r[c]) for c in "xyz"]) for r in rows if stopped < float(r["t_s"]) < stopped + 2.4]
    assert len(after) > 50, "the daemon fell silent"
    rest = [p for t, p in after if t > stopped + 1.5]
    moved = math.dist(after[0][1], after[-1][1])
    print(f"after a STOP: {moved:.3f} m, of it {max(math.dist(rest[0], p) for p in rest):.3f} m after 1.5 s")
    assert moved < 0.5 and max(math.dist(rest[0], p) for p in rest) < 1e-4, "it flew on after an acknowledged STOP"
PYTHON
