#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The planner's gates from bench_plan: speed (CPU time), collisions, limits, success where a path exists. Fails naming
# each that is missed. usage: plan.sh BENCH_PLAN OUTPUT_FOLDER
set -euo pipefail
bench=$(realpath "${1:?usage: plan.sh BENCH_PLAN OUTPUT_FOLDER}")
out=${2:?usage: plan.sh BENCH_PLAN OUTPUT_FOLDER}
mkdir -p "$out"
"$bench" --benchmark_out="$out/plan.json" --benchmark_out_format=json >"$out/plan.txt"

python3 - "$out/plan.json" <<'PYTHON'
import json, sys
rows = {b["name"].removesuffix("/iterations:1"): b for b in json.load(open(sys.argv[1]))["benchmarks"]}
failures = []
def gate(row, counter, most):
    value = rows[row][counter]
    print(f"{row:22s} {counter:11s} {value:8.3f}, at most {most}{'' if value <= most else '  MISSED'}")
    if not value <= most: failures.append(f"{row} {counter} {value:.3f} > {most}")
for counter, most in {"search_p50": 0.4, "search_p95": 0.8, "total_p50": 3, "total_p95": 6}.items():
    gate("forest/first/7", counter, most)
forests = [name for name in rows if name.startswith("forest/")]
successes = [name for name in rows if name.startswith("success/")]
if len(forests) != 6 or len(successes) != 4: failures.append("a benchmark is missing")
for name in forests:
    gate(name, "collisions", 0)
    gate(name, "violations", 0)
    if rows[name]["ok"] != rows[name]["queries"]: failures.append(f"{name}: {rows[name]['ok']:.0f} planned")
for name in successes:
    gate(name, "wrong", 0)
    if not rows[name]["share"] >= 0.99: failures.append(f"{name}: share {rows[name]['share']:.4f}")
sys.exit("; ".join(failures) if failures else 0)
PYTHON
