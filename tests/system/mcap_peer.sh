#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The log of a flight of the real processes, as the daemon wrote it, against independent readers of MCAP and of ROS 2's messages from the
# npm registry (tests/log/peer): what its topics say is what its records, read by other code, and the CSV say. As a kill would leave it, it is
# read to its last whole record by them and by us. `backwash export` of it, and of the same records in the format of before, is the same
# file to all; replay, report, adapt and study take each. Then `backwash merge` with a ULog of what the emulated PX4 said.
#   mcap_peer.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
needs_peers
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
backwash=$build/services/backwash
before=$(date +%s)
"$source_dir/services/bench/flight.sh" "$build" "$out" flight builtin:apartment 3.0,4.2,1.2 7.4,3.0,1.2 builtin:quad-5in 1 px4 >/dev/null &
flying=$!
# What a kill would leave: the file as it lies there in the middle of the flight.
while kill -0 $flying && [[ $(stat -c %s "$out/flight.bwlog" 2>/dev/null || echo 0) -lt 3000000 ]]; do sleep 0.1; done
cp "$out/flight.bwlog" "$out/cut.bwlog"
wait $flying || { cat "$out/flight.log"; exit 1; }
cd "$out"
export PYTHONPATH=$source_dir/tests/system
python3 - <<'PYTHON'
import struct
import raw_log
with open("old.bwlog", "wb") as file:
    file.write(raw_log.MAGIC)
    for t, kind, body in raw_log.records("flight.bwlog"):
        file.write(struct.pack("<qII", round(t * 1e9), kind, len(body)) + body)
PYTHON
"$backwash" export flight.bwlog --mcap flight.mcap --csv flight.csv --json --quiet >export.json
"$backwash" export old.bwlog --mcap old.mcap --json --quiet | sed s/old.bwlog/flight.bwlog/ >old.json
cmp flight.mcap old.mcap || { echo 'in the format of before it is another log'; exit 1; }
node "$source_dir/tests/log/peer/read_mcap.cjs" "$modules" flight.bwlog >peer.json
node "$source_dir/tests/log/peer/read_mcap.cjs" "$modules" flight.mcap >exported.json
truncate -s -5 cut.bwlog
node "$source_dir/tests/log/peer/read_mcap.cjs" "$modules" cut.bwlog cut >cut.json
"$backwash" replay --log cut.bwlog --json | grep -q '"equal": *true'

# However a log is written, it is one flight to every verb.
for log in flight.bwlog old.bwlog flight.mcap flight.csv; do
  for verb in "adapt $log" "study --quick --log $log"; do
    "$backwash" $verb --vehicle builtin:quad-5in --map builtin:apartment --json --quiet | sed "s/$log/LOG/" >$log.${verb%% *}
  done
  [[ $log != *.csv ]] || continue
  "$backwash" replay --log $log --json >$log.replay
  "$backwash" report --log $log --json --quiet | sed "s/$log/LOG/" >$log.report
done
for answer in replay report adapt study; do
  for log in old.bwlog flight.mcap; do
    [[ -s flight.bwlog.$answer ]] && cmp flight.bwlog.$answer $log.$answer || { echo "$answer: $log is another flight"; exit 1; }
  done
done
for answer in adapt study; do
  cmp flight.bwlog.$answer flight.csv.$answer || { echo "$answer: the CSV is another flight"; exit 1; }
done
grep -q '"equal": *true' flight.mcap.replay

python3 - "$before" "$source_dir/ros2/backwash_bringup/plotjuggler/recorded.xml" <<'PYTHON'
import csv, hashlib, json, struct, sys, time
from xml.etree import ElementTree
import raw_log

before = int(sys.argv[1])
peer, told, cut = (json.load(open(f"{name}.json")) for name in ("peer", "export", "cut"))
said, counts = peer["said"], peer["counts"]
records = list(raw_log.records("flight.bwlog"))
ticks = [(t, struct.unpack_from("<3Q6I5fI34d2I", body)) for t, kind, body in records if kind == raw_log.TICK]
odometry = [(t, struct.unpack("<q10d", body)) for t, kind, body in records if kind == raw_log.ODOMETRY]
print({topic: counts.get(topic, 0) for topic in told["messages"]}, "chunks", peer["chunks"], "MCAP", told["messages"])
assert counts == {topic: n for topic, n in told["messages"].items() if n > 0}

# Exported, it is the same but for its chunks.
assert {**peer, "chunks": 0} == {**json.load(open("exported.json")), "chunks": 0}
# Byte for byte the records of before, and as far as it goes of one that is cut short.
old = open("old.bwlog", "rb").read()[len(raw_log.MAGIC):]
assert peer["raw"] == hashlib.sha256(old).hexdigest() and counts["/backwash/raw_log"] == len(records)
begun = list(raw_log.records("cut.bwlog"))
read = cut["counts"]["/backwash/raw_log"]
assert len(records) / 4 < len(begun) == read < len(records), (len(records), len(begun), read)
assert cut["raw"] == hashlib.sha256(old[:sum(16 + len(body) for _, _, body in begun)]).hexdigest()
# PlotJuggler's layout finds every topic that it plots (its members: ros2_bringup).
curves = [curve.get("name") for curve in ElementTree.parse(sys.argv[2]).iter("curve")]
assert len(curves) >= 10 and all(any(curve.startswith(topic + "/") for topic, n in counts.items() if n) for curve in curves), curves

# Wall time, by the flight's own: one difference for all of them.
whole = odometry[0][0] - said["/backwash/odometry"][0]["t"]
assert before <= said["/backwash/odometry"][0]["t"] <= time.time(), said["/backwash/odometry"][0]
assert counts["/backwash/odometry"] == counts["/tf"] == len(odometry) > 500
for (t, (stamp, *numbers)), row, placed in zip(odometry, said["/backwash/odometry"], said["/tf"]):
    p, v, (w, x, y, z) = numbers[:3], numbers[3:6], numbers[6:]
    assert abs(t - row["t"] - whole) < 1e-5 and abs(row["stamp"] - row["t"]) < 1e-5
    assert row["p"] == p == placed["p"] and row["q"] == [w, x, y, z] and (placed["parent"], placed["child"]) == ("map", "base_link")
    # The twist is the body's: turned by the attitude it is the map's again.
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]
    assert max(abs(sum(a * b for a, b in zip(line, row["v"])) - wanted) for line, wanted in zip(turn, v)) < 1e-9

# Each row of the CSV is odometry, in its order.
rows, at = list(csv.DictReader(open("flight.csv"))), 0
assert len(rows) == told["rows"] > 400
for row in rows:
    p = [float(row[c]) for c in ("x_m", "y_m", "z_m")]
    while said["/backwash/odometry"][at]["p"] != p:
        at += 1

sent = [(t, tick) for t, tick in ticks if tick[5] & 1]
assert counts["/backwash/setpoint"] == len(sent) > 400
assert all(row["p"] == list(tick[21:24]) for row, (t, tick) in zip(said["/backwash/setpoint"], sent))
judged = [tick for t, tick in ticks if tick[6]]
assert counts["/backwash/error_over_bound"] == len(judged) > 400
for row, tick in zip(said["/backwash/error_over_bound"], judged):
    assert max(abs(r * h - (p - c)) for r, h, p, c in zip(row["v"], tick[34:37], tick[15:18], tick[31:34])) < 1e-9
assert max(abs(r) for row in said["/backwash/error_over_bound"] for r in row["v"]) < 1

changes = [(m, r) for n, (m, r) in enumerate(t[1][3:5] for t in ticks) if n == 0 or ticks[n - 1][1][3:5] != (m, r)]
assert [row["text"] for row in said["/backwash/mode"]] == [raw_log.MODES[m] for m, _ in changes]
assert counts["/backwash/reason"] == len(changes) and "lifting" in [row["text"] for row in said["/backwash/mode"]]
assert any("verb" in row["text"] for row in said["/backwash/events"])

# Each trajectory once, when it begins, and the tube around it: every command lies in one of its boxes.
flown = [tick[1] for n, (t, tick) in enumerate(ticks) if tick[1] and (n == 0 or ticks[n - 1][1][1] != tick[1])]
assert counts["/backwash/trajectory"] == counts["/backwash/markers"] == len(flown) >= 2, flown
# The scene of Foxglove's own schema shows what the markers do.
for scene, shown in zip(said["/backwash/scene"], said["/backwash/markers"], strict=True):
    cubes = [{"p": s["p"], "scale": s["scale"]} for s in shown["shapes"] if s["type"] == 1 and s["action"] == 0]
    assert (scene["entities"], scene["id"], scene["frame_id"]) == (1, "plan", "map") and scene["cubes"] == cubes and len(cubes) > 1
    assert scene["lines"] == [s["points"] for s in shown["shapes"] if s["type"] == 4] and len(scene["lines"][0]) > 10
for line, shown in zip(said["/backwash/trajectory"], said["/backwash/markers"]):
    clear, strip, *boxes = shown["shapes"]
    assert clear["action"] == 3 and strip["type"] == 4 and strip["points"] == line["p"] and 1 < len(boxes) <= 100
    for p in line["p"]:
        assert any(all(abs(a - c) <= s / 2 + 0.05 for a, c, s in zip(p, box["p"], box["scale"])) for box in boxes), p
    assert all(box["type"] == 1 and min(box["scale"]) > 0 for box in boxes)
(cubes,) = said["/backwash/voxels"][0]["shapes"]
assert cubes["type"] == 6 and len(cubes["points"]) > 1000 and len({tuple(p) for p in cubes["points"]}) == len(cubes["points"])
PYTHON

# With the autopilot's own log: its poses are where they were heard, but for the way, and where the VIO has the vehicle.
python3 -c 'import ulog_maker; ulog_maker.write("fc.ulg", "flight.bwlog")'
"$backwash" merge flight.mcap fc.ulg -o both.mcap --json --quiet >merge.json
node "$source_dir/tests/log/peer/read_mcap.cjs" "$modules" both.mcap >both.json
# Of another flight: at another time, or elsewhere at that time.
for other in "later_ms=600000:none of its poses is of the time of flight.mcap" "north_m=3:its poses are 3.0 m (median) from those"; do
  python3 -c "import ulog_maker; ulog_maker.write('other.ulg', 'flight.bwlog', ${other%%:*})"
  code=0
  "$backwash" merge flight.mcap other.ulg -o none.mcap --quiet 2>refused || code=$?
  [[ $code == 65 && ! -e none.mcap ]] && grep -qF "${other#*:}" refused || { echo "merged with another flight's: $code $(<refused)"; exit 1; }
done
"$backwash" replay --log both.mcap --json | cmp - flight.bwlog.replay
python3 - <<'PYTHON'
import bisect, json, math, statistics
import raw_log, ulog_maker

alone, both, told = (json.load(open(name)) for name in ("peer.json", "both.json", "merge.json"))
clock = told["clock"]
print("merge", clock, "outside", told["outside"], "from the link", told["distance_m"], "m")
assert 0 <= told["distance_m"] < 0.05
assert both["raw"] == alone["raw"] and both["counts"] | {"/tf": 0} == alone["counts"] | {"/tf": 0, "/autopilot/odometry": both["counts"]["/autopilot/odometry"]}
heard = list(ulog_maker.said("flight.bwlog", ulog_maker.LOCAL_POSITION))
poses, odometry = both["said"]["/autopilot/odometry"], both["said"]["/backwash/odometry"]
assert len(heard) - 60 < len(poses) <= len(heard) and len(poses) == told["messages"]["/autopilot/odometry"], (len(heard), len(poses))
first = next(t for t, kind, _ in raw_log.records("flight.bwlog") if kind == raw_log.ODOMETRY)
whole = first - odometry[0]["t"]
by_place = {}
for t, (_, *place) in heard:
    by_place.setdefault(tuple(place[:3]), t)
ways, off = [], []
placed = [row for row in both["said"]["/tf"] if row["child"] == "autopilot"]
assert len(placed) >= 10 and all(row["parent"] == "map" for row in placed)
times = [row["t"] for row in odometry]
for row in poses:
    x, y, z = row["p"]
    ways.append(by_place[(y, x, -z)] - whole - row["t"])  # east, north, up
    tf = [p for p in placed if p["t"] <= row["t"]]
    at = bisect.bisect(times, row["t"])
    if not tf or at in (0, len(times)):
        continue
    c, s = math.cos(tf[-1]["yaw"]), math.sin(tf[-1]["yaw"])
    in_map = [tf[-1]["p"][0] + c * x - s * y, tf[-1]["p"][1] + s * x + c * y, tf[-1]["p"][2] + z]
    off.append(math.dist(in_map, odometry[at]["p"]))
print(f"heard {1e3 * statistics.median(ways):.1f} ms later at the median, {1e3 * min(ways):.1f} to {1e3 * max(ways):.1f}; "
      f"{statistics.median(off):.3f} m from the VIO at the median, {max(off):.3f} at most")
assert len(off) > 400 and -0.005 < statistics.median(ways) < 0.010 and statistics.median(off) < 0.05 and max(off) < 0.25
assert clock["pairs"] >= 2 and clock["rms_ms"] <= clock["largest_ms"] <= clock["round_trip_ms"]
PYTHON
