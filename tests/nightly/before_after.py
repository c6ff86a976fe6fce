#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""before_after.py BACKWASH VEHICLE LOGS [--draws N] [--seed S]: how often `study --before --after` tells a change between two halves of
one vehicle's flights, drawn at random. LOGS: a folder of flight logs. Each draw is a call: a second for 20 flights."""
import argparse
import collections
import glob
import json
import os
import random
import subprocess


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("vehicle")
    parser.add_argument("logs")
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    flights = sorted(glob.glob(os.path.join(asked.logs, "*.csv")))
    rng = random.Random(asked.seed)
    told, by = collections.Counter(), collections.Counter()
    for _ in range(asked.draws):
        order = rng.sample(flights, len(flights))
        half = len(order) // 2
        done = subprocess.run([asked.program, "study", "--quiet", "--json", "--vehicle", asked.vehicle, "--before", *order[:half],
                               "--after", *order[half:]], capture_output=True, text=True, check=True)
        answer = json.loads(done.stdout)
        told[answer["verdict"]] += 1
        by.update(m["name"] for m in answer["measures"] if m["verdict"] != "cannot_be_told")
    print(", ".join(f"{name} {count}" for name, count in told.most_common()), f"of {asked.draws}", *by.items())


main()
