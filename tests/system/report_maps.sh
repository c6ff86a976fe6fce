#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Which map `backwash report` judges which part of a flight by, and that it says what it cannot judge: of a mapper's window
# and of scans the raw log holds no voxel. What was flown is written here, so what has to be told is known.
#   report_maps.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
PYTHONPATH=$here python3 - "$backwash" <<'PYTHON'
import json, subprocess, sys
from raw_log_maker import *

backwash = sys.argv[1]
# Cubes of 1.6 m: the one below the origin in x, y and z, and the one beside it, from x = -3.2 to -1.6.
FREE, BESIDE_FREE, BESIDE_OCCUPIED = 0x40, 0x10, 0x20
FAR = b"\x00\xc0" + b"\x03\x00" * 10 + b"\x01\x00"  # the cube above the origin alone


def cubes(bits):
    return b"\x03\x00" + b"\x00\xc0" * 10 + bytes([0, bits])


def told(log, code, *options):
    log.write("flight.bwlog", None)
    ran = subprocess.run([backwash, "report", "flight.bwlog", "--json", "--quiet", *options], capture_output=True, text=True)
    assert ran.returncode == code, (ran.returncode, ran.stderr)
    text = subprocess.run([backwash, "report", "flight.bwlog", "--quiet"], capture_output=True, text=True).stdout
    return json.loads(ran.stdout), text


def begin(*maps, window=False, scans=False):
    log = RawLog()
    log.at = (-0.8, -0.8, -1.2)
    for octomap in maps:
        log.map(octomap)
    if window:
        log.window()
    if scans:
        log.record(SCAN, b"300 points, 0 new voxels")
    log.fly((-0.8, -0.8, -0.8))
    return log


def outwards(*maps, **seen):
    """From within the cube into the one beside it."""
    log = begin(*maps, **seen)
    log.fly((-2.4, -0.8, -0.8), ticks=100)
    log.land()
    return log


# A window alone: good, and nothing is said of clearances but that they could not be judged, and why.
log = begin(window=True)
log.window()
log.record(WORLD, b"window: 12 voxels far from it are let go, 3 of them occupied: the last whole map speaks for them")
log.record(WORLD, b"window: 8 voxels far from it are let go, 2 of them occupied: the last whole map speaks for them")
log.fly((-2.4, -0.8, -0.8), ticks=100)
log.land()
story, text = told(log, 0, "--out", "page.html")
why = "no whole map had come, and what the mapper's window showed is not in the log"
assert [(c["map"], c["min_clearance_m"], c["ticks"], c["why_not"]) for c in story["clearances"]] == [(None, None, 100, why)], story["clearances"]
assert (story["ticks_judged"], story["ticks_not_judged"], story["min_clearance_m"], story["touched"]) == (0, 100, None, False)
assert story["window"] == {"clouds": 4, "let_go": 20, "let_go_occupied": 5} and story["maps_accepted_s"] == [], story["window"]
assert f"not judged: {why}" in text and "20 voxels, 5 of them occupied" in text, text
page = open("page.html").read()
assert "clearances could not be judged" in page and "nothing touched" not in page and "there was none" in page

# One take-off and one route with the truth beside it is `fly`'s flight, but no world can be made of a window.
open("truth.csv", "w").write("t_s,x_m,y_m,z_m\n" + "".join(f"{1 + 0.02 * k},-2.4,-0.8,-0.8\n" for k in range(log.number)))
story, _ = told(log, 0, "--truth", "truth.csv")
assert story["judged_by"] == "truth" and story["ticks_not_judged"] == 100, story

# A later map says nothing of a flight before it: an obstacle that has gone was touched, one that has come was not.
for then, later, touched in ((BESIDE_OCCUPIED, BESIDE_FREE, True), (BESIDE_FREE, BESIDE_OCCUPIED, False)):
    log = outwards(cubes(FREE | then))
    log.map(cubes(FREE | later))
    open("truth.csv", "w").write("t_s,x_m,y_m,z_m\n" + "".join(f"{1 + 0.02 * k},-2.4,-0.8,-0.8\n" for k in range(log.number)))
    for options in ((), ("--truth", "truth.csv")):
        story, _ = told(log, 1 if touched else 0, *options)
        assert story["touched"] == touched, (options, story)

# A whole map and a window: by the map where it knows the place; what it does not know was no obstacle that was touched.
for seen, name in (({"window": True}, "the mapper's window"), ({"scans": True}, "scans")):
    story, text = told(outwards(cubes(FREE), **seen), 0, "--out", "both.html", "--force")
    first, second = story["clearances"]
    assert (first["map"], first["why_not"]) == (1, "") and 0 < first["min_clearance_m"] < 0.05, first
    assert second["map"] is None and second["min_clearance_m"] is None, second
    assert second["why_not"] == f"map 1 does not know this place, and what {name} showed of it is not in the log", second
    assert abs(second["from_s"] - first["until_s"] - 0.02) < 1e-9 and first["ticks"] + second["ticks"] == 100
    assert story["min_clearance_m"] == first["min_clearance_m"] and not story["touched"]
    assert "at least on what was judged of the routes" in text, text
    page = open("both.html").read()
    assert f"nothing touched where that could be judged, in {first['ticks']} of 100 ticks" in page
    assert "What clearances were judged by" in page
story, text = told(outwards(cubes(FREE)), 1)
assert story["touched"] and "unless" not in story["reason"] and "clearances  " not in text, "a map alone is the whole truth"

# An obstacle of the map is one, unless what came later has freed it: that is said.
for seen, name in (({}, None), ({"window": True}, "the mapper's window"), ({"scans": True}, "scans")):
    story, _ = told(outwards(cubes(FREE | BESIDE_OCCUPIED), **seen), 1)
    assert story["touched"] and story["reason"].startswith("an obstacle was touched"), story["reason"]
    said = f", unless {name} had freed what map 1 holds there: the log does not say"
    assert (said in story["reason"]) == bool(name) and ("unless" in story["reason"]) == bool(name), story["reason"]

# Each place by the map of its time, not by the last one. Before the first there was none.
log = begin()
log.fly((-0.8, -0.8, -0.6), ticks=20)
log.map(cubes(FREE))
log.fly((-0.8, -0.8, -0.8), ticks=30)
log.map(cubes(FREE | BESIDE_FREE))
log.fly((-2.4, -0.8, -0.8), ticks=100)
log.land()
log.map(FAR)
story, text = told(log, 0)
assert [(c["map"], c["ticks"], c["why_not"]) for c in story["clearances"]] == [(None, 20, "no map had come"), (1, 30, ""), (2, 100, "")], story["clearances"]
assert len(story["maps_accepted_s"]) == 3 and not story["touched"] and story["min_clearance_m"] > 0.3, story
assert "by map 1, " in text and "by map 2, " in text and "not judged: no map had come" in text, text

# One that cannot be read judges nothing.
log = begin(b"\x03\x00\x00")
log.fly((-0.8, -0.8, -0.6), ticks=20)
log.land()
assert "map 1 cannot be read: " in told(log, 0)[0]["clearances"][0]["why_not"]

# A mapper that sends one a second: people see the first of them, --json has all.
log = begin()
for k in range(12):
    log.map(cubes(FREE))
    log.fly((-0.8, -0.8, -0.8 + 0.1 * (k % 2)), ticks=5)
log.land()
story, text = told(log, 0)
assert len(story["clearances"]) == 12 and "and 2 more: --json has all" in text, text
PYTHON
