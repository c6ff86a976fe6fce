#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The VIO's frame turns by 90 degrees in flight (docs/faults.md row 41): the flight is held within two ticks of the
# first turned sample, lands, and no set-point goes anywhere on what the VIO says from there on.
#   attack_03_turned_vio.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --wire "$work/wire.csv" --log "$work/truth.csv"
"$build/tests/attacker" "$domain" relay rt/backwash/odometry rt/turned/odometry turn 1.5707963 0 >"$work/turned" &
more_pids+=($!)
start_daemon builtin:quad-5in "$work/flight.bwlog" rt/turned/odometry
enable
ctl takeoff --height 1.2 --wait
ctl goto 2,0,1.2
sleep 6
stop
cat "$work/turned" >>"$log"
PYTHONPATH=$source_dir/tests/system python3 - "$work" <<'PYTHON'
import csv, math, sys
import raw_log
work = sys.argv[1]
turned = float(open(work + "/turned").read().split()[0])
ticks = list(raw_log.ticks(work + "/flight.bwlog"))
missed = max(t.missed for t in ticks if t.t > turned - 1) * 0.020
hold = next(t for t in ticks if t.t > turned and t.mode != "tracking")
truth = [{k: float(v) for k, v in r.items()} for r in csv.DictReader(open(work + "/truth.csv")) if float(r["t_s"]) > turned]
sent = [(float(r["t_s"]), [float(r[c]) for c in "xyz"]) for r in csv.DictReader(open(work + "/wire.csv"))
        if r["id"] == "84" and float(r["t_s"]) > turned]
aside = max(abs(r["y_m"]) for r in truth)
after = [p for t, p in sent if t > turned + 0.060 + missed]
print(f"+{(hold.t - turned) * 1e3:.0f} ms {hold.mode}, {aside:.2f} m aside, {len(after)} set-points later, modes "
      f"{sorted({t.mode for t in ticks if t.t > turned})}")
assert hold.t - turned <= 0.060 + missed, "a turned frame was flown on"
assert all(math.dist(p, after[0]) < 1e-3 for p in after), "new positions from a turned frame"
assert aside < 0.6, "the vehicle left its route"
assert truth[-1]["armed"] == 0 and truth[-1]["landed"] == 1, "it did not end on the ground"
assert not [t for t in ticks if t.t > hold.t + missed and t.mode == "tracking"], "it went on by itself"
PYTHON
