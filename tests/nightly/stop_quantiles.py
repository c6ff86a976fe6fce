#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How long STOPs took, ms, one a line on standard input: p50, p99 and max. Exit 1: the median waits for more than what
lies on the way, which is the reader, 5 ms of the mission, one tick of 20 ms and the line."""
import sys

MOST_MEDIAN_MS = 40
latencies = sorted(float(line) for line in sys.stdin)
count = len(latencies)
p50, p99 = (latencies[min(count - 1, int(q * count))] for q in (0.5, 0.99))
print(f"{count} stops: p50 {p50:.1f}, p99 {p99:.1f}, max {latencies[-1]:.1f} ms")
sys.exit(p50 >= MOST_MEDIAN_MS)
