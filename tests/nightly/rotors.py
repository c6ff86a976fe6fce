#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""rotors.py BACKWASH LOGS [--choices N] [--seed S] [--neighbours]: how often `study --reference` calls a sound craft damaged.

LOGS: a folder of imported flights of one sound craft, in the order in which they were flown by name. Of each choice some
4 and more flights are the reference and up to 4 others are judged; --neighbours: both are neighbours in time."""
import argparse
import collections
import glob
import json
import os
import random
import subprocess


def verdict(program, reference, judged):
    command = [program, "study", "--quick", "--json", "--vehicle", "builtin:quad-5in", "--reference", *reference, "--log", *judged]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode == 65:  # a flight without hovering rotors
        return "refused"
    return json.loads(done.stdout)["rotors_against_reference"]["verdict"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("logs")
    parser.add_argument("--choices", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--neighbours", action="store_true")
    asked = parser.parse_args()
    flights = sorted(glob.glob(os.path.join(asked.logs, "*.csv")))
    rng = random.Random(asked.seed)
    told = collections.Counter()
    for _ in range(asked.choices):
        order = flights[:]
        if asked.neighbours:
            first = rng.randrange(len(order))
            order = order[first:] + order[:first]
        else:
            rng.shuffle(order)
        known = rng.randint(4, len(order) - 1)
        told[verdict(asked.program, order[:known], order[known:known + rng.randint(1, 4)])] += 1
    print(", ".join(f"{name} {count}" for name, count in told.most_common()), f"of {asked.choices}")


main()
