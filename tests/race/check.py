#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The race still runs: two pairs of one vehicle, resumed, summarised. check.py RACE"""
import os
import subprocess
import sys
import tempfile

import summary

program = sys.argv[1]
assert abs(summary.limits(0, 100)[1] - 0.036217) < 1e-5 and abs(summary.limits(5, 100)[0] - 0.016432) < 1e-5
assert summary.auc([3, 2], [1, 2]) == 0.875

with tempfile.TemporaryDirectory() as folder:
    path, picture = os.path.join(folder, "race.csv"), os.path.join(folder, "curves.svg")
    fly = [program, "fly", path, "1", "2", "gaps", "35g-firm"]
    subprocess.run(fly, check=True)
    first = open(path, encoding="utf-8").read()
    subprocess.run(fly, check=True)
    assert open(path, encoding="utf-8").read() == first, "what is in the file was flown again"

    cells, rows = summary.read(path)
    assert len(cells) == 6, "three airs at two speeds"
    ways = summary.pooled(cells)
    assert len(ways) == 17 and all(s.pairs == 12 for s in ways.values())
    # A door of 0.6 m is wide for 0.13 m, and a margin of 0.6 m fits through none.
    assert ways["margin 0.00"].flown == 12 and ways["margin 0.60"].flown == 0
    assert ways["tight"].flown <= ways["risk 1e-2"].flown and ways["tight"].touched == 0
    summary.race(path, picture)
    assert open(picture, encoding="utf-8").read().count("<circle") == 17

    # A heat that was cut off does not count.
    with open(path, "w", encoding="utf-8") as file:
        file.write(first[:first.rindex("0,gaps")])
    assert not summary.read(path)[0]
