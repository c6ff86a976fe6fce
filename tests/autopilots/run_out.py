#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One row of faults.sh: what the vehicle did after a fault, from its simulator's truth.

run_out.py AUTOPILOT FAULT TRUTH_CSV AT CONTACTS SAID

AT: s, monotonic, as the truth's t_s. Exits 1 if the vehicle touched the map, was not at rest within 12 s, or the daemon did not
say what docs/faults.md asks for.
"""
import csv
import math
import sys

AT_REST = 0.1  # m/s, for a second
WITHIN = 12.0  # s
# What the daemon says of each, in this order; all but the first may come or not.
SAYS = {"hold": "", "stop": "hold: operator asks to stop", "land": "land: operator asks to land", "vio_stop": "hold: odometry lost",
        "vio_freeze": "hold: odometry frozen|hold: odometry contradicts|hold: map and autopilot", "vio_jump": "hold: odometry jumped", "vio_turn": "hold: odometry jumped",
        "sigstop": "quiet: no heartbeat|hold: autopilot's pose|quiet: port|hold: map and autopilot|hold: odometry lost", "kill": "passive: started",
        "restart": "land: operator asks to land", "pilot": "passive: autopilot left offboard",
        "battery": "land: battery low|passive: autopilot left offboard", "rc": "passive: autopilot left offboard",
        "gcs": "passive: autopilot left offboard", "link": "quiet: no heartbeat", "reboot": "tracking: lifted off", "stop_arming": "land: operator asks to stop|passive: ",
        "stop_takeoff": "land: operator asks to stop|hold: operator asks to stop", "stop_plan": "hold: operator asks to stop", "stop_replan": "hold: operator asks to stop",
        "stop_land": "land: operator asks to land", "stop_goto": "hold: operator asks to stop"}


def main() -> int:
    autopilot, fault, path, at, contacts, said = sys.argv[1:]
    at = float(at)
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
    good = contacts == "0" and end["t_s"] - at > rest + 1 and rest < WITHIN
    good = good and any(text in said for text in SAYS[fault].split("|"))
    print(f"{'ok  ' if good else 'FAIL'} {autopilot:9} {fault:10} {speed(start):.2f} m/s, {run_out:.2f} m further, at rest after {rest:.1f} s "
          f"at z = {end['z_m']:.2f} m, contacts {contacts}; {said or 'nothing said'}")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
