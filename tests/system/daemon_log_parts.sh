#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A raw log in parts of 2 MiB: the daemon leaves each on the ground alone, a flight is in one of them, which `report` tells by itself, and
# all together are replayed bit for bit; not one without those before it.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
# part N: its file.
part() { [[ $1 == 1 ]] && echo "$work/flight.bwlog" || echo "$work/flight-$1.bwlog"; }
# wait_for N: until part N is there.
wait_for() {
  for _ in $(seq 400); do [[ -e $(part "$1") ]] && return; sleep 0.1; done
  die "part $1 was not begun"
}
start_bench "$build/services" "$log" builtin:apartment 3.0,4.2,1.2 builtin:quad-5in
more_tables='max_mib = 2' start_daemon builtin:quad-5in "$work/flight.bwlog"
wait_for 2
enable
ctl takeoff --height 1.2 --wait
ctl goto 7.4,3.0,1.2 --wait
ctl land --wait
wait_for 3
stop
parts=()
for n in 1 2 3 4 5; do [[ ! -e $(part $n) ]] || parts+=("$(part $n)"); done
"$bin/backwash" replay --log "${parts[@]}" --json >"$work/whole.json" || { cat "$work/whole.json"; die "the parts together differ"; }
code=0
"$bin/backwash" replay --log "$(part 2)" --json >"$work/second.json" 2>"$work/second" || code=$?
[[ $code == 65 ]] && grep -q 'begins with part 2 of its log' "$work/second" || die "part 2 alone was replayed, exit $code"
"$bin/backwash" report --log "$(part 2)" --json --quiet >"$work/flight.json" || die "part 2 is no good flight"
"$bin/backwash" report --log "$(part 1)" --json --quiet >"$work/all.json" || die "part 1 and those beside it are no good flight"
"$bin/backwash" export "${parts[@]}" --mcap "$work/whole.mcap" --quiet >/dev/null
"$bin/backwash" replay --log "$work/whole.mcap" --json | cmp - "$work/whole.json" || die "the parts as one MCAP are another log"
PYTHONPATH=$source_dir/tests/system python3 - "$work" "${parts[@]}" <<'PYTHON'
import json, sys
import raw_log
work, *parts = sys.argv[1:]
whole, flight, all_parts = (json.load(open(f"{work}/{name}.json")) for name in ("whole", "flight", "all"))
assert all_parts["take_offs"] == 1 and all_parts["time_s"] > flight["time_s"] and all_parts["samples"] == flight["samples"], all_parts
ticks = [[t for t in raw_log.ticks(path)] for path in parts]
print("ticks by part", [len(part) for part in ticks], "replayed", whole["ticks"])
assert whole["equal"] and whole["ticks"] == sum(map(len, ticks)) and whole["ticks_missing"] == 0, whole
assert [t.number for part in ticks for t in part] == list(range(whole["ticks"])), "a tick is missing or comes twice"
assert all(part[-1].mode == "passive" for part in ticks[:-1]), "a part was left in flight"
assert flight["ok"] and flight["take_offs"] == flight["landings"] == 1 and flight["min_clearance_m"] > 0, flight
PYTHON
