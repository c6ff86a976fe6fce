#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Holds field, tube and plan of another processor's build, run under qemu-user, against this one's, and replays raw logs there.

  toolchains/agree.py NATIVE OTHER… [--log LOG …]     NATIVE: a program backwash; OTHER…: the command that runs the other one

Prints the largest difference of each. Exit code 1: a number of field or tube differs by more than 1e-6 of it (and 1e-9 of its
unit), a raw log is not decided alike bit for bit, or a plan has another status, another search, or a length or time that differs
by more than 1 %. Set-points of plans are told, not judged: Debian's NLopt for arm64 adds products in one rounding, that for amd64
does not, and an optimiser's way makes more of a last bit.
"""
import json
import random
import subprocess
import sys
import tempfile

CRAFT = ["--model", "builtin:quad-5in", "--vehicle", "builtin:quad-5in"]
RELATIVE, ABSOLUTE = 1e-6, 1e-9


def difference(a, b, where=""):
    """The largest share of what is allowed, and where."""
    if isinstance(a, dict) and isinstance(b, dict) and a.keys() == b.keys():
        parts = [difference(a[k], b[k], f"{where}.{k}") for k in a if not k.endswith("_ms")]
    elif isinstance(a, list) and isinstance(b, list) and len(a) == len(b):
        parts = [difference(x, y, f"{where}[{k}]") for k, (x, y) in enumerate(zip(a, b))]
    elif isinstance(a, (int, float)) and isinstance(b, (int, float)) and not isinstance(a, bool):
        return abs(a - b) / (RELATIVE * abs(a) + ABSOLUTE), where
    else:
        return (0.0 if a == b else float("inf")), where
    return max(parts, default=(0.0, where))


def same_plan(a, b):
    one, other = a["metrics"], b["metrics"]
    return (
        a["status"] == b["status"]
        and one["expanded"] == other["expanded"]
        and all(abs(one[k] - other[k]) <= 0.01 * one[k] for k in ("length_m", "time_s"))
    )


def main():
    words = sys.argv[1:]
    logs = words[words.index("--log") + 1 :] if "--log" in words else []
    commands = words[: words.index("--log")] if "--log" in words else words
    if len(commands) < 2:
        sys.exit(__doc__)
    native, other = commands[:1], commands[1:]
    folder = tempfile.mkdtemp()
    rng = random.Random(20261126)
    points, track = f"{folder}/points.csv", f"{folder}/track.csv"
    with open(points, "w") as file:
        print("x_m,y_m,z_m", file=file)
        for _ in range(500):
            print(f"{rng.uniform(0.3, 9.7):.4f},{rng.uniform(0.3, 5.7):.4f},{rng.uniform(0.3, 2.2):.4f}", file=file)
    with open(track, "w") as file:
        print("t_s,cmd_x_m,cmd_y_m,cmd_z_m,cmd_vx_mps,cmd_vy_mps,cmd_vz_mps,cmd_ax_mps2,cmd_ay_mps2,cmd_az_mps2", file=file)
        for k in range(300):
            print(f"{k * 0.02:.2f},{3 + 0.01 * k:.4f},4.2,1.2,0.5,0,0,0,0,0", file=file)
    apartment = ["--map", "builtin:apartment"]
    asked = {
        "field, exact, 500 points": ["field", *apartment, *CRAFT, "--points", points],
        "field, stored": ["field", *apartment, *CRAFT, "--points", points, "--interpolated"],
        "tube of 300 set-points": ["reach", *apartment, *CRAFT, "--track", track],
        "tube by ellipsoids": ["reach", *apartment, *CRAFT, "--track", track, "--method", "paper"],
        "plan, apartment": ["plan", *apartment, *CRAFT, "--start", "3.0,4.2,1.2", "--goal", "7.4,3.0,1.2"],
        "plan, narrow gap": ["plan", "--map", "builtin:narrow-gap", *CRAFT, "--start", "1,0,1", "--goal", "5,0,1"],
        "plan, forest": ["plan", "--map", "builtin:forest-0", *CRAFT, "--start=-9,0,1.5", "--goal", "9,0,1.5"],
    }
    failed = False
    for name, words in asked.items():
        said = []
        for program in (native, other):
            done = subprocess.run([*program, *words, "--json", "--quiet"], capture_output=True, text=True)
            if done.returncode not in (0, 69) or not done.stdout:
                sys.exit(f"{name}: {' '.join(program)} ended with {done.returncode}: {done.stderr.strip()}")
            said.append(json.loads(done.stdout))
        share, where = difference(*said)
        held = same_plan(*said) if words[0] == "plan" else share <= 1
        failed = failed or not held
        print(f"{name}: {share * RELATIVE:.1e} at most, at {where}{'' if held else '  DIFFERS'}", flush=True)
    for log in logs:
        done = subprocess.run([*other, "replay", "--log", log, "--json", "--quiet"], capture_output=True, text=True)
        failed = failed or done.returncode != 0
        print(f"replay of {log}: exit {done.returncode}, {done.stdout.strip()[:400]}{done.stderr.strip()[:400]}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
