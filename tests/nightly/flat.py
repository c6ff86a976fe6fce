#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Resident memory, kB a second, one a line: fails if the last tenth's median is more than 1 MiB above that of the second
tenth (the first still touches buffers for the first time)."""
import statistics
import sys

rss = [int(line) for line in open(sys.argv[1])]
assert len(rss) >= 20, "too few samples: the daemon did not live"
tenth = len(rss) // 10
early, late = statistics.median(rss[tenth:2 * tenth]), statistics.median(rss[-tenth:])
print(f"resident memory over {len(rss)} s: {early / 1024:.2f} MiB early, {late / 1024:.2f} MiB late, {(late - early):+.0f} kB")
sys.exit(late - early > 1024)
