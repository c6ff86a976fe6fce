#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwashctl adaptation` with real processes: what is shown, orders that are done and told, a reset that is refused while
# enabled, the file that a reset forgets in, the raw log that holds each order and is replayed; a daemon that learns nothing.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
adaptation() { "$bin/backwashctl" --domain "$domain" adaptation "$@" 2>&1; }
shows() { # shows EXPRESSION: of the JSON, within 2 s
  local shown
  for _ in $(seq 20); do
    shown=$(adaptation --json)
    python3 -c 'import json, sys; sys.exit(not eval(sys.argv[2], {"s": json.loads(sys.argv[1])}))' "$shown" "$1" && return
    sleep 0.1
  done
  die "not shown: $1; but $shown"
}

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
more_tables="[adaptation]
enabled = true
file = \"$work/air.factors\""
start_daemon builtin:quad-5in "$work/flight.bwlog"
shows 's == {"learns": True, "frozen": False, "classes": []}'
# As if earlier flights had learnt it: the daemon's own file, with a factor in it.
stop
python3 - "$work/air.factors" <<'PYTHON'
import sys
text = open(sys.argv[1]).read().replace("\nwall 1\n", "\nwall 1.5\n").rsplit("check ", 1)[0]
h = 0xcbf29ce484222325
for byte in text.encode():
    h = (h ^ byte) * 0x100000001b3 % 2**64
open(sys.argv[1], "w").write(f"{text}check {h:016x}\n")
PYTHON
rm -f "$work/autopilot"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
shows '[(c["class"], c["factor"], c["seconds"]) for c in s["classes"]] == [("wall", 1.5, 0)]'
[[ $(adaptation) == 'wall      factor 1.50, ln evidence 0.0, 0 s of flight' ]] || die "$(adaptation)"
ctl adaptation freeze
shows 's["frozen"]'
ctl adaptation thaw
shows 'not s["frozen"]'
enable
adaptation reset >"$work/refused" && die "it was reset while enabled"
grep -q 'adaptation reset: refused: a reset makes sets smaller: not while enabled: disable first' "$work/refused" || die "$(cat "$work/refused")"
shows 's["classes"][0]["factor"] == 1.5'
ctl disable
for _ in $(seq 20); do adaptation reset >"$work/reset" && break; sleep 0.1; done
shows 's["classes"] == []'
for _ in $(seq 20); do grep -q '^wall 1$' "$work/air.factors" && break; sleep 0.1; done
grep -q '^wall 1$' "$work/air.factors" || die "the file has not forgotten: $(cat "$work/air.factors")"
grep -q 'world made anew in .* for reset air' "$log" || die "no world was made of it"
stop
"$bin/backwash" replay --log "$work/flight-2.bwlog" >>"$log" 2>&1 || die "the log is not replayed"
[[ $(PYTHONPATH=$source_dir/tests/system python3 -c 'import raw_log, sys; print(sum(k == 20 for _, k, _ in raw_log.records(sys.argv[1])))' "$work/flight-2.bwlog") == 3 ]] ||
  die "the log does not hold the three orders that were taken"

rm -f "$work/autopilot"
more_tables=''
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/plain.bwlog"
shows 's == {"learns": False, "frozen": False, "classes": []}'
adaptation freeze >"$work/refused" && die "nothing was frozen"
grep -q 'adaptation.enabled is false' "$work/refused" || die "$(cat "$work/refused")"
