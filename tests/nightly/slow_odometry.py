#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The table of slow_odometry.sh: slow_odometry.py OUT_DIR. Sets are read from the raw logs' offers (core/log/raw/tick_replay.cpp)."""
import json
import pathlib
import struct
import sys

sys.path.append(str(pathlib.Path(__file__).parent.parent / "system"))
from raw_log import TICK, records

OFFER = 12
HEAD, COMMAND, SET = 10, 10, 16  # doubles


def route_sets(path):
    """Half widths along y (m) of the route that was offered last, from where it is begun on, and the clearance's place."""
    tube, commands, first = [], [], None
    offers = {}
    for _, kind, body in records(path):
        if kind == OFFER:
            numbers = struct.unpack(f"<{len(body) // 8}d", body)
            count, sets = int(numbers[7]), int(numbers[8])
            start = HEAD + COMMAND * count
            offers[int(numbers[0])] = ([numbers[HEAD + COMMAND * k:HEAD + COMMAND * (k + 1)] for k in range(count)],
                                       [numbers[start + SET * k:start + SET * (k + 1)] for k in range(sets)])
        elif kind == TICK:
            segment, index = struct.unpack_from("<QQ", body, 8)
            if segment and segment in offers:
                if first is None or segment != first[0]:
                    first = (segment, index)
    commands, tube = offers[first[0]]
    moving = next(k for k, c in enumerate(commands) if any(c[3:6]))
    return [s[7] for s in tube[moving:]]


def main():
    out = pathlib.Path(sys.argv[1])
    names = [p.stem for p in sorted(out.glob("*.json"), key=lambda p: p.stat().st_mtime) if not p.stem.endswith("status")]
    rows, good = [], True
    for name in names:
        flown, status = json.loads((out / f"{name}.json").read_text()), json.loads((out / f"{name}.status.json").read_text())
        replay = json.loads((out / f"{name}.replay").read_text())
        half = route_sets(out / f"{name}.bwlog")
        kept = (flown["ok"] and status["samples_outside"] == 0 and status["samples_inside"] > 0 and replay["equal"])
        good = good and kept
        rows.append((name, status["samples_inside"], status["samples_outside"], max(flown["largest_error_over_bound"].values()),
                     half[0], half[12], flown["set_clearance_m"], flown["min_clearance_m"], kept))
    if not rows:
        sys.exit("no flights in " + str(out))
    print("| odometry | samples inside / outside | largest error over bound | half width across, first moving set, 0.24 s later, m | left over by the sets, m | flown, m | |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, inside, outside, share, first, later, planned, least, kept in rows:
        print(f"| {name} | {inside} / {outside} | {share:.2f} | {first:.4f}, {later:.4f} | {planned:.3f} | {least:.3f} | {'kept' if kept else 'FAILED'} |")
    sys.exit(0 if good else 1)


main()
