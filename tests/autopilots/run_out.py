#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One row of faults.sh: what the vehicle did after a fault, from its simulator's truth, and what the daemon sent, from its raw log.

run_out.py AUTOPILOT FAULT TRUTH_CSV AT CONTACTS SAID RAW_LOG SINCE

AT: s, monotonic, as the truth's t_s; the row is of what came after it. SINCE: the same of the fault's first command, from which
set-points and sets are judged. Exits 1 if the vehicle touched the map, was not at rest within 12 s, or the daemon did not say what
docs/faults.md asks for. Of faults of several commands also if a set-point stepped as no flight can, a sample left its set, or the
set-point moved after a stop had come to rest. Those with a second command count from when the daemon had it.
"""
import csv
import math
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import raw_log  # noqa: E402

AT_REST = 0.1  # m/s, for a second
OVER = 0.05    # m/s, the way that was last commanded
WITHIN = 12.0  # s
BLIND = 20.0   # s, where nothing tells the autopilot any more where it is
# Of a set-point in a tick, as tests/daemon/plan/planner_test.cpp demands it, with the a_max of 1 m/s² of both vehicle files: how far
# it may be from where the velocities before and after lead; and its velocity's step.
OFF_WAY, VELOCITY_STEP = 3e-3, 3.5 / 2 * 0.02  # m, m/s
STOPPED = 3.0  # s from a stop to where its set-point rests: the way to its branch, braking, and the process that sends it
STILL = 1e-3   # m
COMMAND, STOP, HOLD = 4, 8, 5
# What the daemon says of each, in this order; all but the first may come or not. None: nothing.
STOPS = "hold: operator asks to stop"
SAYS = {"hold": "", "stop": STOPS, "land": "land: operator asks to land", "vio_stop": "hold: odometry lost",
        "vio_freeze": "hold: odometry frozen|hold: odometry contradicts|hold: map and autopilot", "vio_jump": "hold: odometry jumped", "vio_turn": "hold: odometry jumped",
        "sigstop": "quiet: no heartbeat|hold: autopilot's pose|quiet: port|hold: map and autopilot|hold: odometry lost", "kill": "passive: started", "frozen": "passive: started", "line_off": "quiet: no heartbeat", "power_off": "",
        "restart": "land: operator asks to land", "pilot": "passive: autopilot left offboard",
        "battery": "land: battery low|passive: autopilot left offboard", "rc": "passive: autopilot left offboard",
        "gcs": "passive: autopilot left offboard", "link": "quiet: no heartbeat", "late": "hold: line to the autopilot slow", "streams": None, "reboot": "tracking: lifted off", "stop_arming": "land: operator asks to stop|passive: ",
        "stop_takeoff": "land: operator asks to stop|hold: operator asks to stop", "stop_plan": STOPS, "stop_replan": STOPS,
        "stop_land": "land: operator asks to land", "stop_goto": STOPS}
# Faults of several commands: each of its set-points and sets is judged.
SEVERAL = {"hold_stop_0.2": STOPS, "hold_stop_0.45": STOPS, "hold_stop_1.0": STOPS, "stop_hold": STOPS, "hold_hold": "", "door_hold_stop": STOPS,
           "door_hold_goto": "", "gap_hold_stop": STOPS, "gap_hold_goto": "", "vio_gap_stop": "hold: odometry lost"}


def setpoints(path, since):
    """On the wire from then on: (time in s, position, velocity), in the autopilot's frame."""
    for t, kind, frame in raw_log.records(path):
        if kind == raw_log.FRAME_OUT and raw_log.message_id(frame) == raw_log.SETPOINT and t >= since:
            x = struct.unpack_from("<6f", frame[10:10 + frame[1]] + bytes(64), 4)
            yield t, x[:3], x[3:]


def off_way(a, b):
    """How far a set-point is from where the velocities of both lead to in a tick from the one before, m."""
    return math.dist(b[1], [p + 0.01 * (v + w) for p, v, w in zip(a[1], a[2], b[2])])


def orders(path, since):
    """When the daemon had which command, from then on: (time in s, verb)."""
    for t, text in raw_log.lines(path, COMMAND):
        words = text.split()
        if t >= since and "verb" in words:
            yield t, int(words[words.index("verb") + 1])


def sent(path, since, fault):
    """What set-points, sets and mode were since the fault: a text, and whether all was as it has to be."""
    sent_ = list(setpoints(path, since - 0.1))
    pairs = [(a, b) for a, b in zip(sent_, sent_[1:]) if b[0] - a[0] < 0.1]
    off = max((off_way(a, b) for a, b in pairs), default=0.0)
    velocity = max((math.dist(a[2], b[2]) for a, b in pairs), default=0.0)
    ticks = [t for t in raw_log.ticks(path) if t.t >= since]
    judged = [t for t in ticks if t.judged]
    inside = sum(t.inside for t in judged)
    orders_ = list(orders(path, since))
    stops = [t for t, verb in orders_ if verb == STOP]
    moved = 0.0
    if stops:
        after = [p for t, p, _ in sent_ if t > stops[-1] + STOPPED]
        moved = max((math.dist(after[0], p) for p in after), default=0.0)
    frozen = fault.startswith("vio")  # by the reaction itself: zero velocity at once
    good = (frozen or off <= OFF_WAY and velocity <= VELOCITY_STEP) and inside == len(judged) and moved <= STILL
    return (f"set-point off its way {off * 1e3:.1f} mm, steps {velocity:.3f} m/s, inside {inside} of {len(judged)}, moved on {moved * 1e3:.1f} mm, "
            f"ends in {ticks[-1].mode if ticks else 'nothing'}"), good


def commanded(after):
    """How long the vehicle goes on by what it was last told, s: until it slows down; until it moves that way no more."""
    first = after[0]
    speed = math.hypot(first["vx_mps"], first["vy_mps"])
    along = [(r["t_s"] - first["t_s"], (r["vx_mps"] * first["vx_mps"] + r["vy_mps"] * first["vy_mps"]) / max(speed, 1e-9)) for r in after]
    over = next((t for t, v in along if v <= OVER), math.inf)
    return max((t for t, v in along if t <= over and v >= speed - AT_REST), default=0.0), over


def main() -> int:
    autopilot, fault, path, at, contacts, said, raw, since = sys.argv[1:]
    at = float(at)
    told = [t for t, verb in orders(raw, float(since)) if verb in (STOP, HOLD)]
    apart = f", {told[1] - told[0]:.2f} s apart" if len(told) > 1 else ""
    if fault in SEVERAL and len(told) > 1:
        at = told[-1]
    rows = [{k: float(v) for k, v in row.items() if v} for row in csv.DictReader(open(path))]
    after = [r for r in rows if r["t_s"] >= at and "vz_mps" in r]
    if not after:
        print(f"{autopilot} {fault}: no truth after the fault")
        return 1
    place = lambda r: (r["x_m"], r["y_m"], r["z_m"])
    speed = lambda r: math.dist((r["vx_mps"], r["vy_mps"], r["vz_mps"]), (0, 0, 0))
    start = after[0]
    run_out = max(math.dist(place(r)[:2], place(start)[:2]) for r in after)
    moving = [r["t_s"] for r in after if speed(r) > AT_REST]
    rest = (moving[-1] - at) if moving else 0.0
    end = after[-1]
    good = contacts == "0" and end["t_s"] - at > rest + 1 and rest < (BLIND if fault.endswith("_off") else WITHIN)
    wanted = (SAYS | SEVERAL)[fault]
    good = good and (not said if wanted is None else any(text in said for text in wanted.split("|")))
    slows, over = commanded(after)
    wire, possible = sent(raw, float(since), fault)
    good = good and (fault not in SEVERAL or possible)
    print(f"{'ok  ' if good else 'FAIL'} {autopilot:9} {fault:10}{apart} {speed(start):.2f} m/s, {run_out:.2f} m further, slows after {slows:.2f} s, over after {over:.2f} s, at rest after {rest:.1f} s "
          f"at ({end['x_m']:.2f}, {end['y_m']:.2f}, {end['z_m']:.2f}) m, contacts {contacts}; {wire}; {said or 'nothing said'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
