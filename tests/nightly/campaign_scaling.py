#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a campaign costs beside its work, and the time that Table I with 200 pairs and the study's matrix would take on many cores.

  campaign_scaling.py BACKWASH

Seconds of processor, user and system, so that a machine that others use tells the same: a small comparison by its commands alone, by
`campaign run --jobs 1` and by `--jobs 2`, each in a folder of its own. The projection gives each core that is free the next shard.
"""
import heapq
import json
import os
import resource
import subprocess
import sys
import tempfile

SMALL = 'kind = "compare"\nseconds = 12\n[compare]\nscenes = ["builtin:corridors", "builtin:narrow-gap"]\nflights = 60\n'
LARGE = {"Table I, 200 pairs": 'kind = "compare"\n[compare]\nflights = 200\n',
         "the study's matrix, 28 cells of 200 worlds": 'kind = "program"\nseconds = 3\n[program]\ncommand = ["true", "{seed}"]\ncount = 5600\n'}
SLURM_S = 1.0  # of a task of Slurm, of its own processor


def cpu(*commands):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for command in commands:
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def planned(backwash, name, text):
    with open(name + ".toml", "w", encoding="utf-8") as file:
        file.write(text)
    subprocess.run([backwash, "campaign", "plan", name + ".toml", "-o", name], check=True, stdout=subprocess.DEVNULL)
    with open(name + "/manifest.json", encoding="utf-8") as file:
        return json.load(file)


def shards_s(manifest):
    first = manifest["shards"] + [len(manifest["items"])]
    return [sum(item["seconds"] for item in manifest["items"][a:b]) for a, b in zip(first, first[1:])]


def finished(shards, cores, more_s):
    """When the last of these shards ends."""
    free = [0.0] * min(cores, len(shards))
    for seconds in shards:
        heapq.heappush(free, heapq.heappop(free) + seconds + more_s)
    return max(free)


def main():
    backwash = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        commands = [[backwash, *item["command"][1:]] for item in planned(backwash, "alone", SMALL)["items"]]
        shards = len(shards_s(planned(backwash, "one", SMALL)))
        planned(backwash, "two", SMALL)
        cpu(*commands)  # worlds that are kept between runs
        alone = cpu(*commands)
        one, two = (cpu([backwash, "campaign", "run", name, "--jobs", jobs, "--quiet"]) for name, jobs in (("one", "1"), ("two", "2")))
        merge = cpu([backwash, "campaign", "merge", "two", "--quiet"])
        each = (one - alone) / shards
        print(f"{shards} shards: {alone:.1f} s of processor by their commands alone, {one:.1f} s by one job, {two:.1f} s by two; merge {merge:.2f} s")
        print(f"overhead of a shard {each:.3f} s; work over all that was spent: one job {alone / one:.3f}, two jobs {alone / two:.3f}")
        for name, text in LARGE.items():
            work = shards_s(planned(backwash, name.split(",", maxsplit=1)[0], text))
            print(f"{name}: {len(work)} shards, {sum(work):.0f} s of work as planned, the longest {max(work):.0f} s")
            for cores in (1, 2, 10, 100, 1000):
                seconds = finished(work, cores, max(each, 0) + (SLURM_S if cores > 2 else 0))
                print(f"  {cores:4} cores {seconds:8.0f} s, efficiency {sum(work) / seconds / cores:.2f}")


if __name__ == "__main__":
    main()
