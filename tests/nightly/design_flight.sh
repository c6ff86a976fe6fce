#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The next flight of a study that cannot tell a draft from a trim, flown by the daemon on the bench: every place of the
# points file in its order, turned to its heading, every sample inside its set, as long as told. About two minutes.
#   design_flight.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
"$build/tests/study_worlds/study_worlds" --out "$work/world" --seed 1796200003 --cause draft --confound yaw >>"$log" 2>&1
"$bin/backwash" study --quick --json --map "$work/world/map.bt" --vehicle "$work/world/vehicle.toml" --model builtin:quad-5in \
  --log "$work"/world/*.csv --design "$work/next.csv" --start 2,2,1 >"$work/study.json" 2>>"$log"

start_bench "$build/services" "$log" "$work/world/map.bt" 2,2,1 builtin:quad-5in --log "$work/truth.csv"
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.0 --wait
ctl follow "$work/next.csv" --wait
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
ctl land --wait
stop
python3 - "$work" <<'PYTHON'
import csv, json, math, sys
work = sys.argv[1]
status, told = json.load(open(work + "/status.json")), json.load(open(work + "/study.json"))["design"]["flights"][0]
rows = lambda name: [{c: float(x) if x else None for c, x in row.items()} for row in csv.DictReader(open(f"{work}/{name}.csv"))]
place_of = lambda row: [row[c] for c in ("x_m", "y_m", "z_m")]
turned = lambda row: math.atan2(2 * (row["qw"] * row["qz"] + row["qx"] * row["qy"]), 1 - 2 * (row["qy"] ** 2 + row["qz"] ** 2))
truth, at, times, headings = rows("truth"), 0, [], 0
for row in rows("next"):
    yaw = row.get("yaw_rad")
    headings += yaw is not None
    near = [n for n in range(at, len(truth)) if math.dist(place_of(truth[n]), place_of(row)) < 0.12
            and (yaw is None or abs(math.remainder(turned(truth[n]) - yaw, math.tau)) < 0.1)]
    assert near, f"{row} was not reached in its order"
    at = near[0]
    times.append(truth[at]["t_s"])
took = times[-1] - times[0]
print(f"{len(times)} places in their order, {headings} with a heading, {status['samples_inside']} samples inside, {status['samples_outside']} outside; "
      f"{took:.0f} s from the first to the last, told {told['time_s']:.0f} s with the way there")
assert status["samples_outside"] == 0, status
PYTHON
