#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwash report` on every kind of raw log: many take-offs and routes, an order that ends one, a fault, refusals, none that took
# off, a daemon that ended itself, samples outside, something touched, and a kill at any byte. What was flown is written here,
# so what has to be told is known.
#   report.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
PYTHONPATH=$here python3 - "$backwash" <<'PYTHON'
import json, math, os, random, re, subprocess, sys
from raw_log_maker import *

backwash = sys.argv[1]


def told(log, code, *options, most=None):
    """What report says of a log: JSON, and the line on stderr."""
    log.write("flight.bwlog", most)
    ran = subprocess.run([backwash, "report", "--log", "flight.bwlog", "--json", "--quiet", *options], capture_output=True, text=True)
    assert ran.returncode in ([code] if code is not None else [0, 1]), (ran.returncode, ran.stderr)
    assert ran.stderr.count("\n") == (ran.returncode != 0), ran.stderr
    return json.loads(ran.stdout), ran.stderr


def good_flight():
    log = RawLog()
    log.wait()
    for _ in range(2):
        x, y, _ = log.at
        log.fly((x, y, 1))
        log.command(GO_TO, (x + 2, y, 1))
        log.command(RELEASE)
        log.fly((x + 2, y, 1))
        log.fly((x + 2, y + 1, 1), ticks=30)
        log.command(STOP)
        for _ in range(20):
            log.tick("hold", STOP_REQUESTED, log.segments, 29)
        log.land()
    return log


log = good_flight()
story, said = told(log, 0)
assert story["ok"] and story["reason"] == "" and said == "" and story["judged_by"] == "measured"
assert [story[k] for k in ("take_offs", "landings", "holds", "refusals")] == [2, 2, 2, 0], story
assert [p["kind"] for p in story["pieces"]] == ["take-off", "route", "route"] * 2
assert all(p["end"] == "reached" and p["samples"] == p["samples_inside"] > 0 for p in story["pieces"]), story["pieces"]
assert abs(story["length_m"] - 2 * (1 + 2 + 1)) < 0.2 and story["min_clearance_m"] is None
assert abs(story["time_s"] - 0.02 * (log.number - 1)) < 1e-9 and story["ended"].startswith("on the ground")
text = subprocess.run([backwash, "report", "flight.bwlog"], capture_output=True, text=True, check=True).stdout
assert "judged by measured positions" in text and "4 " not in text.split("\n")[0]

# With the truth beside it clearances and goals are the truth's.
open("truth.csv", "w").write("t_s,x_m,y_m,z_m\n" + "".join(f"{1 + 0.02 * k},9,9,9\n" for k in range(log.number)))
story, said = told(log, 1, "--truth", "truth.csv")
assert story["judged_by"] == "truth" and "was missed by" in story["reason"] and story["samples_inside"] == story["samples"]
assert story["ticks_beyond_truth"] == 0
# Where it ends early, what the vehicle measured is judged, and how much that is, is told.
open("short.csv", "w").write("t_s,x_m,y_m,z_m\n" + "".join(f"{1.01 + 0.02 * k},9,9,9\n" for k in range(50)))
story, said = told(log, 0, "--truth", "short.csv")
assert story["ticks_beyond_truth"] == log.number - 55, story["ticks_beyond_truth"]  # for 0.1 s more the last row is near enough

# One that never took off, by what was refused.
log = RawLog()
log.wait()
log.command(GO_TO, (1, 1, 1), result=1, reason="no map was received")
log.wait()
story, said = told(log, 1)
assert story["reason"] == "the vehicle never took off: refused: no map was received" and story["reason"] in said
assert story["refusals"] == 1 and not story["goal_reached"] and story["pieces"] == []

# Threads write their records when they come to it: the story is in the order of time.
log = RawLog()
log.wait()
log.t -= 30_000_000
log.command(GO_TO, (1, 1, 1), result=1, reason="no map was received")
log.t += 30_000_000
log.wait(1)
log.tick("enabling", STARTED)
log.t -= 50_000_000
log.record(FAILURE, b"late")
story, _ = told(log, 1)
assert [e["t"] for e in story["events"]] == sorted(e["t"] for e in story["events"]), story["events"]

# Nothing but the first line, as after a start that was killed.
assert told(RawLog(), 1)[0]["ended"] == "no control tick was recorded"

# A lift-off has no commands of its own: with the rise after it, it is one take-off.
log = RawLog()
log.in_air = True
log.tick("lifting", STARTED, 1000, judged=True)
for _ in range(50):
    log.tick("lifting", STARTED, 1000, judged=False)
log.fly((0, 0, 1))
log.fly((2, 0, 1))
log.land()
story, _ = told(log, 0)
assert [(p["kind"], p["samples"]) for p in story["pieces"]] == [("take-off", 51), ("route", 50)], story["pieces"]

# An order ends a route: that is no miss. A fault does not. That the station gives its session back, as each call does, is no
# part of the story.
log = RawLog()
log.fly((0, 0, 1))
log.fly((4, 0, 1), ticks=100, until=40)
log.command(STOP)
log.command(RELEASE)
for k in range(10):
    log.tick("hold", STOP_REQUESTED, log.segments, 40 + k)
log.land()
story, _ = told(log, 0)
assert story["pieces"][1]["end"] == "ended by an order", story["pieces"]
log = RawLog()
log.fly((0, 0, 1))
log.fly((4, 0, 1), ticks=100, until=40)
for k in range(20):
    log.tick("hold", ODOMETRY_LOST, log.segments, 40)
for k in range(20):
    log.tick("land", ODOMETRY_LOST)
log.in_air = False
log.wait()
story, _ = told(log, 1)
assert "missed by 2.40 m: odometry lost" in story["reason"] and story["holds"] == 1, story["reason"]

# An order that is flown at the next tick ends the route before it, too.
log = RawLog()
log.fly((0, 0, 1))
log.fly((4, 0, 1), ticks=100, until=40)
log.command(GO_TO, (1, 3, 1))
log.fly((1, 3, 1))
log.land()
story, _ = told(log, 0)
assert [p["end"] for p in story["pieces"]] == ["reached", "ended by an order", "reached"], story["pieces"]

# A goal above one in the air is no take-off, and can be missed. After a landing the rise is one again.
log = RawLog()
log.fly((0, 0, 1))
log.fly((0, 0, 2))
log.fly((0, 0, 3), ticks=100, until=40)
for k in range(20):
    log.tick("hold", ODOMETRY_LOST, log.segments, 40)
log.land()
log.fly((0, 0, 1))
log.land()
story, _ = told(log, 1)
assert [p["kind"] for p in story["pieces"]] == ["take-off", "route", "route", "take-off"], story["pieces"]
assert "(0.00, 0.00, 3.00) was missed by 0.60 m: odometry lost" in story["reason"], story["reason"]

# Of two goals that were missed, each for its own reason. A third was left since an operator asked to land.
log = RawLog()
log.fly((0, 0, 1))
for goal, fault in (((4, 0, 1), ODOMETRY_LOST), ((2, 0, 1), AIR_ROUGHER)):
    log.command(GO_TO, goal)
    log.fly(goal, ticks=100, until=40)
    for k in range(20):
        log.tick("hold", fault, log.segments, 40)
log.fly((0, 0, 1), ticks=100, until=40)
log.land()
story, _ = told(log, 1)
assert [p["end"] for p in story["pieces"]][3] == "ended by an order", story["pieces"]
assert [r.split(": ")[1] for r in story["reason"].split("; ")] == ["odometry lost", "air rougher than the flight allows for"], story["reason"]

# Samples outside, and their number.
log = RawLog()
log.fly((0, 0, 1))
log.fly((4, 0, 1), ticks=90)
log.fly((5, 0, 1), ticks=10, error=0.15)
log.land()
story, _ = told(log, 1)
assert story["reason"].startswith("10 of 150 samples lay outside") and abs(story["largest_error_over_bound"]["x"] - 1.5) < 1e-9, story

# A daemon that ended itself in the air, a record that was lost before.
log = RawLog()
log.fly((0, 0, 1))
log.record(LOST, struct.pack("<Q", 12))
log.record(FAILURE, b"planner: out of memory")
story, _ = told(log, 1)
assert story["reason"].startswith("the daemon ended itself: planner: out of memory; the log ends in the air"), story["reason"]
assert story["records_lost"] == 12

# By the map: 5 cm to what nobody knows is less than the body.
log = RawLog()
log.free_cube()
log.at = (-0.8, -0.8, -1.2)
log.fly((-0.8, -0.8, -0.8))
log.fly((-0.8, -0.5, -0.8))
log.land()
story, _ = told(log, 0)
assert 0 < story["min_clearance_m"] < 0.5
log.fly((-0.8, -0.05, -0.8))
log.fly((-0.05, -0.05, -0.8))
log.land()
story, _ = told(log, 1)
assert story["touched"] and story["min_clearance_m"] < 0 and story["reason"].startswith("an obstacle was touched"), story["reason"]

# What others know of the end comes first, on the page too.
story, said = told(good_flight(), 1, "--because", "the battery fell out", "--out", "page.html")
assert story["reason"] == "the battery fell out" and not story["ok"]
page = open("page.html").read()
assert "Not good: the battery fell out" in page and page.count("<svg") >= 3 and "asked to go to" in page
assert "the session" not in page, "each call of the station is told twice"

# A log in parts: of the first alone the later ones beside it are read, but not a file of another log.
def part(number, log_id=77):
    log = RawLog()
    log.record(17, struct.pack("<qqII", log_id, 0, number, 0))
    log.wait()
    return log


log = part(3)
log.t = 10**10
log.fly((0, 0, 1))
log.fly((2, 0, 1))
log.land()
for name, made in (("flight-2", part(2, 5)), ("flight-3", part(2)), ("flight-4", log), ("flight-5", part(5))):
    made.write(f"{name}.bwlog", None)
story, _ = told(part(1), 0)
assert story["take_offs"] == story["landings"] == 1 and story["log"] == "flight.bwlog" and story["time_s"] > 9, story
os.remove("flight-3.bwlog")
assert told(part(1), 1)[0]["take_offs"] == 0, "a part that is missing ends the log"

# What it learnt of its air: a factor that grew, not one that earlier flights had learnt; evidence as a share of what it takes.
log = RawLog()
log.free_cube()
log.learns(start=(1, 1, 1.5, 1, 1))
log.at = (-0.8, -0.8, -1.2)
log.wait()
log.learnt = ("ground", (1, 1, 1.5, 1, 1), math.log(10 / 0.01) / 2, math.log(1e-9))
log.fly((-0.8, -0.8, -0.8))
log.learnt = ("wall", (1, 1, 2.0, 1, 1), 0.0, 0.0)
log.fly((-0.8, -0.3, -0.8))
log.record(WORLD, b"the flight is stopped in rougher air: the rest of it is not clear; wall 2.00 times")
log.record(WORLD, b"snapshot 3 ms after its newest data")
log.land()
story, _ = told(log, None, "--out", "air.html")
events = [(round(e["t"], 2), e["what"]) for e in story["events"] if e["kind"] == "air"]
assert events == [(1.1, "air of class wall: errors have above 2.00 times the variance promised, ln evidence 0.0"),
                  (2.1, "the flight is stopped in rougher air: the rest of it is not clear; wall 2.00 times")], events
shrunk = RawLog()
shrunk.free_cube()
shrunk.learns()
shrunk.at = (-0.8, -0.8, -1.2)
shrunk.wait()
shrunk.learnt = ("ground", (1, 0.5946, 1, 1, 1), 0.0, math.log(1e-9))
shrunk.fly((-0.8, -0.8, -0.8))
shrunk.learnt = ("ground", (1, 1, 1, 1, 1), 0.0, math.log(1e-9))
shrunk.fly((-0.8, -0.3, -0.8))
shrunk.land()
told_of_air = [e["what"] for e in told(shrunk, None)[0]["events"] if e["kind"] == "air"]
assert told_of_air == ["air of class ground is calmer: errors have below 0.59 times the variance promised",
                       "air of class ground is no longer as calm as shown: its sets are the model's again"], told_of_air
assert not any(e["kind"] == "air" for e in told(good_flight(), 0, "--out", "calm.html")[0]["events"])
page, calm = open("air.html").read(), open("calm.html").read()
for part in ("<h2>Air</h2>", "<h2>Where the air was rough</h2>", 'class="name">air<'):
    assert part in page and part not in calm, part
data = json.loads(re.search(r'id="data">(.*?)</script>', page)[1])
columns, rows = next((table["columns"], table["rows"]) for table in data["tables"] if table["id"] == "air")
assert columns == ["t_s", "x_m", "y_m", "z_m", "class", "factor_ground", "factor_wall", "evidence_ground", "evidence_wall"], columns
first, last = (dict(zip(columns, row)) for row in (rows[0], rows[-1]))
assert (first["factor_wall"], first["class"], first["evidence_wall"]) == (1.5, 1, None) and abs(first["evidence_ground"] - 0.5) < 1e-6, first
assert (last["factor_wall"], last["class"], last["evidence_wall"]) == (2.0, 2, 1), last

# Killed at any byte: all whole records before it are told, and nothing is a defect or bad data.
log, chance = good_flight(), random.Random(20261123)
ends = [19]
while ends[-1] < len(log.bytes):
    ends.append(ends[-1] + 16 + struct.unpack_from("<I", log.bytes, ends[-1] + 12)[0])
for cut in [*range(19), *sorted(chance.sample(range(19, len(log.bytes)), 200))]:
    story, _ = told(log, None, most=cut)
    whole = max((e for e in ends if e <= cut), default=0)  # 0: not even the first line
    assert story["cut_at"] == (whole if whole < max(cut, 1) else None), (cut, story["cut_at"])
    assert story["ok"] or story["reason"]
told_at = [story["time_s"] for story in (told(log, None, most=n)[0] for n in ends[100::100])]
assert told_at == sorted(told_at)
PYTHON
