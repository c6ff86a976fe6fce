#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From flights that never turned to the next flight: a points file whose every leg `plan` verifies by itself, which
# `backwashctl follow` reads, and after which a further study of such flights would separate.
# usage: design.sh BACKWASH STUDY_WORLDS BACKWASHCTL
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
worlds=${2:?} ctl=${3:?}

"$worlds" --out world --seed 1796100001 --cause trim --confound yaw --flights 18 --truth truth.json >log 2>&1
model=$(python3 -c 'import json; print(json.load(open("truth.json"))["model"])')
study=("$backwash" study --map world/map.bt --vehicle world/vehicle.toml --model "$model" --quick --log world/*.csv)
"${study[@]}" --design next.csv --start 1.6,1.5,1.2 --report study.html --json >study.json 2>stderr || die "$(cat stderr)"
grep -q "<h2>The next flight</h2>" study.html && grep -q "backwashctl follow next.csv" study.html || die "the page does not say what to fly"
status=0
"${study[@]}" --design other.csv 2>stderr || status=$?
[[ $status == 64 && ! -e other.csv ]] || die "a design without a start: exit $status"
status=0
"${study[@]}" --design next.csv --start 1.6,1.5,1.2 2>stderr || status=$?
[[ $status == 73 ]] || die "overwrites a points file, exit $status"
status=0
"${study[@]}" --design other.csv --start 0,0,0 >log 2>stderr || status=$?
[[ $status == 69 && ! -e other.csv ]] || die "begins in a wall: exit $status"
# No daemon runs: 69 says that the file was read, 65 that it was not.
status=0
"$ctl" --timeout 0.2 --interface lo follow next.csv 2>stderr || status=$?
[[ $status == 69 ]] || die "backwashctl follow: exit $status, $(cat stderr)"

from=1.6,1.5,1.2
tail -n +2 next.csv | cut -d, -f1-3 | sort -u >places
while read -r to; do
  "$backwash" plan --map world/map.bt --vehicle world/vehicle.toml --model "$model" --start "$from" --goal "$to" >log 2>&1 ||
    die "the leg to $to is not verified: $(cat log)"
done <places

python3 - <<'PYTHON'
import json
d = json.load(open("study.json"))
assert d["verdict"] == "cannot_distinguish", d["verdict"]
design = d["design"]
assert design["points"] == "next.csv" and design["message"].startswith("fly: turn the heading"), design["message"]
assert set(design["sets"][0]["names"]) == {"trim", "draft"} and abs(sum(design["sets"][0]["probability"]) - 1) < 1e-9
best = design["flights"][0]
assert best["separated"] >= 0.9 and 1 <= best["flights"] <= 40 and best["divergence_nats"] > 0
rows = open("next.csv").read().splitlines()
on_the_spot = "on the spot" in design["message"]
assert rows[0] == ("x_m,y_m,z_m,yaw_rad" if on_the_spot else "x_m,y_m,z_m") and len(rows) - 1 == best["rows"] <= (32 if on_the_spot else 64)
still = [f for f in design["flights"] if f["name"].startswith("stand still")]
assert still and all(f["flights"] is None for f in still)
assert design["left_out"] and all(o["why"] for o in design["left_out"])
PYTHON
