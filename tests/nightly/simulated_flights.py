#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What `backwash study` tells of flights by `backwash simulate` that lack nothing, by craft and manoeuvre.

simulated_flights.py BACKWASH OUT [SETS [FIRST [AIR]]]    a table; a line of JSON for each set goes to OUT/results.jsonl

A set is 12 flights of one craft: the two that ship or one of 35 g, in one of two corridors. `short` are hovers of 1 s, `fast` level
passes at 3 m/s, `climbs` up and down at 2 m/s and 4 m/s², `hovers` of 8 s. AIR `model` (default) are gusts of the model's own law: every
name is false. In the airflow truth, `truth`, gusts come in bursts, and heavy_tails is none.
"""
import json
import pathlib
import random
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIMITS = {"short": (1.5, 2.0), "fast": (3.0, 4.0), "climbs": (2.0, 4.0), "hovers": (1.5, 2.0)}
CORRIDORS = {"parallel-walls-4m": 1.4, "parallel-walls-2m": 0.5}
SMALL = {"radius": 0.05, "diagonal_radius": 0.06, "rotor_radius": 0.0225, "mass": 0.035, "latency": 0.015, "attitude_lag": 0.04, "max_thrust": 0.6, "thr_mdl_fac": 0.6,
         "kp": "{ horizontal = 9.0, vertical = 12.0 }", "kd": "{ horizontal = 5.0, vertical = 6.0 }"}


def vehicle(craft, manoeuvre, folder):
    """A vehicle file with the limits of the manoeuvre."""
    name = "quad-5in" if craft == "35g" else craft
    text = (ROOT / f"core/config/files/{name}.vehicle.toml").read_text()
    v_max, a_max = LIMITS[manoeuvre]
    for key, value in ((SMALL if craft == "35g" else {}) | {"v_max": v_max, "a_max": a_max}).items():
        text = re.sub(rf"(?m)^{key} = (\{{[^}}]*\}}|[^ \n]+)", f"{key} = {value}", text)
    (folder / "vehicle.toml").write_text(text)
    return folder / "vehicle.toml"


def hovers(manoeuvre, half_width, rng):
    """Start, and places with the seconds to stay."""
    def spot():
        return [rng.uniform(-2.4, 2.4), rng.uniform(-half_width, half_width), rng.uniform(0.4, 2.2)]
    if manoeuvre == "short":
        return spot(), [(spot(), 1.0) for _ in range(30)]
    if manoeuvre == "hovers":
        return spot(), [(spot(), 8.0) for _ in range(10)]
    at = spot()
    if manoeuvre == "fast":
        return at, [([-2.4 if k % 2 else 2.4, rng.uniform(-half_width, half_width), at[2]], rng.uniform(1, 4)) for k in range(16)]
    return at, [([at[0], at[1], rng.uniform(0.4, 0.7) if k % 2 else rng.uniform(1.6, 2.2)], 1.0) for k in range(20)]


def run(*arguments):
    return subprocess.run([str(a) for a in arguments], check=True, capture_output=True, text=True).stdout


def told(backwash, folder, craft, manoeuvre, corridor, seed, air):
    """Names of the causes, and what else is told."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = random.Random(f"{manoeuvre} {corridor} {seed}")
    file, model, logs = vehicle(craft, manoeuvre, folder), "builtin:quad-7in" if craft == "quad-7in" else "builtin:quad-5in", []
    for flight in range(12):
        start, places = hovers(manoeuvre, CORRIDORS[corridor], rng)
        text = f"start = {start}\nseed = {100 * seed + flight}\nstrength_sd = 0.35\n" + "".join(f"[[hover]]\np = {p}\ndwell = {s}\n" for p, s in places)
        (folder / "flight.toml").write_text(text)
        logs.append(folder / f"{flight}.csv")
        run(backwash, "simulate", "--map", f"builtin:{corridor}", "--vehicle", file, "--model", model, "--air", air, "--flight", folder / "flight.toml", "--out", logs[-1], "--force", "--quiet")
    found = json.loads(run(backwash, "study", "--map", f"builtin:{corridor}", "--vehicle", file, "--model", model, "--json", "--quick", "--quiet", "--log", *logs))
    for log in logs:
        log.unlink()
    causes = [c["name"] + "".join(f" {k} {p['value']:.3f}" for k, p in c["parameters"].items()) for c in found["causes"]]
    return {"craft": craft, "manoeuvre": manoeuvre, "corridor": corridor, "seed": seed, "air": air, "verdict": found["verdict"], "causes": causes}


def main():
    backwash, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    given = sys.argv[3:]
    sets, first, air = int(given[0]) if given else 24, int(given[1]) if given[1:] else 1, given[2] if given[2:] else "model"
    kinds = [(c, m, k) for m in LIMITS for k in CORRIDORS for c in ("quad-5in", "quad-7in", "35g")]
    out.mkdir(parents=True, exist_ok=True)
    rows = {m: [0, 0, 0] for m in LIMITS}
    for n in range(sets):
        craft, manoeuvre, corridor = kinds[n % len(kinds)]
        one = told(backwash, out / "set", craft, manoeuvre, corridor, first + n // len(kinds), air)
        with (out / "results.jsonl").open("a") as results:
            print(json.dumps(one), file=results)
        for k, add in enumerate((1, bool(one["causes"]), one["verdict"] == "unknown_structure")):
            rows[manoeuvre][k] += add
    print("| manoeuvre | sets | with a name | unknown structure |\n| --- | --- | --- | --- |")
    for manoeuvre, row in rows.items():
        print(f"| {manoeuvre} | {row[0]} | {row[1]} | {row[2]} |")


if __name__ == "__main__":
    main()
