#!/usr/bin/env python3
"""Worlds by the dozen through `backwash study`, one line of JSON each, and the table of what it told.

measure.py run BACKWASH OUT NAME:FIRST-LAST ...    generates and studies; appends to OUT/results.jsonl; logs are removed
measure.py table RESULTS                           counts
"""
import collections
import glob
import json
import os
import subprocess
import sys

from effects import EFFECTS
from generate import generate

BATCH = 16  # worlds simulated at once
COLUMNS = ("alone", "beside", "set", "part", "unknown", "nothing", "wrong")


def study(program, folder, model="model.toml", options=()):
    """The study's JSON of one world, with a model file of its folder."""
    files = {k: os.path.join(folder, f) for k, f in (("--map", "room.bt"), ("--model", model), ("--vehicle", "vehicle.toml"))}
    logs = sorted(glob.glob(os.path.join(folder, "flight*.csv")))
    command = [program, "study", "--quick", "--json", *options] + [x for pair in files.items() for x in pair] + ["--log"] + logs
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def answer(name, told):
    """One of COLUMNS. Where nothing is right, "nothing" is; where unknown structure is right, that alone. "part": of several that are right."""
    right = EFFECTS[name][1]
    causes = told["causes"]
    if not causes:
        return "unknown" if told["verdict"] == "unknown_structure" else "nothing"
    if right is None or right == "unknown_structure":
        return "wrong"
    rights, singles, sets = right.split("+"), [c["name"] for c in causes if len(c["set"]) == 1], [c["set"] for c in causes]
    if all(r in singles for r in rights):
        return "alone" if len(causes) == len(rights) else "beside"
    held = sum(any(r in told_set for told_set in sets) for r in rights)
    if any(not set(rights) & set(told_set) for told_set in sets):
        return "wrong"
    return "set" if held == len(rights) else "part" if held else "wrong"


def run(program, out, worlds):
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, "results.jsonl"), "a", encoding="ascii") as results:
        for first in range(0, len(worlds), BATCH):
            batch = worlds[first:first + BATCH]
            for (name, seed), folder in zip(batch, generate(out, batch)):
                told = study(program, folder)
                causes = [dict({k: c[k] for k in ("name", "set", "p", "parameters")}, nats=c["gain"]["held_out_nats"]) for c in told["causes"]]
                row = dict(name=name, seed=seed, answer=answer(name, told), verdict=told["verdict"], causes=causes, unknown=told["unknown"],
                           not_tested=told["not_tested"], dependence=told["remaining_dependence"], windows=told["windows"])
                results.write(json.dumps(row) + "\n")
                results.flush()
                for log in glob.glob(os.path.join(folder, "flight*.csv")):
                    os.remove(log)


def table(path):
    """Counts by world, and the names that were told where they are not right."""
    counts, others = collections.defaultdict(collections.Counter), collections.defaultdict(collections.Counter)
    with open(path, encoding="ascii") as file:
        for row in map(json.loads, file):
            counts[row["name"]][row["answer"]] += 1
            others[row["name"]].update("+".join(c["set"]) for c in row["causes"] if c["set"] != [EFFECTS[row["name"]][1]])
    print("| world | right answer | worlds | " + " | ".join(COLUMNS) + " | told besides |")
    print("| --- " * (len(COLUMNS) + 4) + "|")
    for name in (n for n in EFFECTS if n in counts):
        c = counts[name]
        besides = ", ".join(f"{k} {n}" for k, n in others[name].most_common())
        print(f"| {name} | {EFFECTS[name][1] or 'nothing'} | {sum(c.values())} | " + " | ".join(str(c[k]) for k in COLUMNS) + f" | {besides} |")


def main():
    if len(sys.argv) == 3 and sys.argv[1] == "table":
        return table(sys.argv[2])
    if len(sys.argv) < 5 or sys.argv[1] != "run":
        sys.exit(__doc__)
    worlds = []
    for text in sys.argv[4:]:
        name, seeds = text.split(":")
        first, last = (int(s) for s in (seeds.split("-") * 2)[:2])
        worlds += [(name, seed) for seed in range(first, last + 1)]
    return run(sys.argv[2], sys.argv[3], worlds)


if __name__ == "__main__":
    main()
