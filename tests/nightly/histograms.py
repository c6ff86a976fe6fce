#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Histograms of a raw log's tick times and wake-ups; fails when a 99th percentile is above its limit (us)."""
import argparse
import math
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "system"))
import raw_log

options = argparse.ArgumentParser()
options.add_argument("log")
options.add_argument("--tick-p99", type=float, required=True)
options.add_argument("--lateness-p99", type=float, required=True)
options = options.parse_args()

ticks = [t for t in raw_log.ticks(options.log)][1:]
assert len(ticks) > 500, "too short a flight"
failed = False
for name, values, limit in (("tick compute", [t.compute_us for t in ticks], options.tick_p99),
                            ("wake-up late", [t.lateness_us for t in ticks], options.lateness_p99)):
    values.sort()
    p50, p99 = values[len(values) // 2], values[math.ceil(0.99 * len(values)) - 1]
    print(f"{name}: n {len(values)}, p50 {p50:.0f}, p99 {p99:.0f} (limit {limit:.0f}), max {values[-1]:.0f} us")
    low = 1.0
    while low < values[-1] * 2:
        count = sum(low <= v < 2 * low for v in values)
        print(f"  {low:8.0f} … {2 * low:8.0f} us {count:6d} {'#' * math.ceil(60 * count / len(values))}")
        low *= 2
    failed |= p99 > limit
print(f"missed periods: {sum(t.missed for t in ticks)}")
sys.exit(failed)
