#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""An item of a test's campaign: a row that depends on seed and cell alone, after a while.

campaign_rows.py SEED CELL [SECONDS]
"""
import hashlib
import json
import sys
import time

seed, cell = int(sys.argv[1]), sys.argv[2]
time.sleep(float(sys.argv[3]) if len(sys.argv) > 3 else 0)
print(json.dumps({"seed": seed, "cell": cell, "value": int(hashlib.sha256(f"{seed} {cell}".encode()).hexdigest()[:12], 16) / 7}))
