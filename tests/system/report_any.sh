#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwash report` judges by what the daemon judged by, whatever that was, and says what it cannot judge or draw: what sets and
# take-offs leave, flights that left their sets, decisions that cannot be made again, logs in which nothing was recorded.
#   report_any.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
PYTHONPATH=$here python3 - "$backwash" "$here/../.." <<'PYTHON'
import json, lzma, pathlib, struct, subprocess, sys
import raw_log
from raw_log_maker import *

backwash, source = sys.argv[1], pathlib.Path(sys.argv[2])
CUT = source / "tests/data/flights/left_its_set.bwlog.xz"
WHOLE = source / "../shared/data/field/judged_against_another_set.bwlog.xz"


def told(log, code, *options):
    log.write("flight.bwlog", None)
    ran = subprocess.run([backwash, "report", "flight.bwlog", "--json", "--quiet", *options], capture_output=True, text=True)
    assert ran.returncode == code and ran.stderr.count("\n") == code, (ran.returncode, ran.stderr)
    return json.loads(ran.stdout), ran.stderr


# What the set leaves of the way to what nobody knows; what stands beside a take-off, whatever floor is below.
RADIUS, ESTIMATION = 0.16, 0.02
log = RawLog()
log.free_cube()
log.at = (-0.8, -0.3, -1.5)
log.fly((-0.8, -0.3, -0.8))
log.fly((-0.7, -0.4, -0.8))
log.land()
story, _ = told(log, 0)
assert abs(story["set_clearance_m"] - (0.302 - 0.1 - RADIUS - ESTIMATION)) < 1e-6, story["set_clearance_m"]  # from its first command on
assert abs(story["take_off_clearance_m"] - (0.3 - RADIUS)) < 1e-6 and story["take_off_ticks_not_judged"] == 0, story["take_off_clearance_m"]
log = RawLog()
log.free_cube()
log.at = (-0.8, -0.1, -1.5)
log.fly((-0.8, -0.1, -0.8))
log.fly((-0.8, -0.8, -0.8))
log.land()
story, _ = told(log, 1)
assert story["touched"] and abs(story["take_off_clearance_m"] - (0.1 - RADIUS)) < 1e-6, story["take_off_clearance_m"]
assert "(clearance -0.060 m)" in story["reason"], story["reason"]
log = RawLog()
log.fly((0, 0, 1))
log.land()
assert told(log, 0)[0]["take_off_ticks_not_judged"] == 50

# The daemon leaves a route for a stop: its sets are that one's, and no commands of the route give them. Both the made flight and
# a real one (tests/data/README.md), whole where it is at hand: with truth and without, the samples are those of its ticks.
log = RawLog()
log.free_cube()
log.at = (-0.8, -0.8, -1.2)
log.fly((-0.8, -0.8, -0.8))
log.fly((-0.8, -0.3, -0.8), until=20, error=0.02)
for k in range(20, 50):
    log.tick("hold", ODOMETRY_LOST, log.segments, k, (-0.7, -0.6, -0.8), error=0.12)
log.write("made.bwlog", None)
flown = ["made.bwlog"]
for packed in (CUT, WHOLE):
    if packed.is_file():
        flown.append(packed.stem)
        open(packed.stem, "wb").write(lzma.open(packed).read())
for name in flown:
    ticks = [(t, struct.unpack_from("<3Q6I5fI34d2I", body)) for t, kind, body in raw_log.records(name) if kind == TICK]
    with open("flown.csv", "w") as file:
        file.write("t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps,ax_mps2,ay_mps2,az_mps2\n")
        file.writelines(",".join(map(str, [t, *tick[15:21], 0, 0, 0])) + "\n" for t, tick in ticks)
    for truth in ([], ["--truth", "flown.csv"]):
        page = ["--out", f"{name}.html", "--force"]
        ran = subprocess.run([backwash, "report", name, "--json", "--quiet", *truth, *page], capture_output=True, text=True)
        assert ran.returncode == 1 and ran.stderr.count("\n") == 1, ran.stderr
        story = json.loads(ran.stdout)
        judged = [tick[7] for _, tick in ticks if tick[6]]
        assert (story["samples"], story["samples_inside"]) == (len(judged), sum(judged)) and sum(judged) < len(judged), story
        assert "lay outside" in story["reason"] and "was missed by" in story["reason"], story["reason"]
        assert f"{sum(judged)} of {len(judged)}</td>" in open(f"{name}.html").read(), name

# Each decision is made again from what it was made from, where the log has that.
if WHOLE.is_file():
    story = json.loads(subprocess.run([backwash, "report", WHOLE.stem, "--json"], capture_output=True, text=True).stdout)
    assert story["replay"] == {"ticks": 2093, "differing_ticks": 0, "ticks_missing": 0, "why_not": ""}, story["replay"]
assert "no constants" in told(RawLog(), 1)[0]["replay"]["why_not"]

# What was never recorded is not drawn, and the page says so: no tick, one, none with a set-point.
for ticks in (0, 1, 200):
    log = RawLog()
    log.wait(ticks)
    told(log, 1, "--out", "nothing.html", "--force")
    page = open("nothing.html").read()
    flown = ["odometry to wire.", "clearance.", "error along x, error along y, error along z."]
    for missing in ["battery.", *(flown if ticks else ["computing, late, odometry to wire."])]:
        assert "Not drawn, because the log has no value of it: " + missing in page, (ticks, missing)
WHOLE.is_file() or print(f"without {WHOLE.name}: it is not at hand")
PYTHON
