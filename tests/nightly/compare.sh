#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The paper's Table I in full: at least 2,000 m of flight per method, both vehicles, built-in scenes and geb079 where
# the examples of liboctomap-dev are installed. Fails if the proposed method touches anything or leaves a set; everything else is reported.
# usage: compare.sh BACKWASH OUTPUT_FOLDER [SEED]
set -euo pipefail
backwash=$(realpath "${1:?usage: compare.sh BACKWASH OUTPUT_FOLDER [SEED]}")
out=${2:?usage: compare.sh BACKWASH OUTPUT_FOLDER [SEED]}
seed=${3:-1}
flights=200
mkdir -p "$out"
building=$(realpath "$(dirname "${BASH_SOURCE[0]}")/../data/maps/geb079.bt")

# A campaign: what was cut goes on with the next call of the same arguments. Another seed is another folder.
campaign=$out/campaign-$seed
for scene in builtin:{apartment,corridors,narrow-gap,forest-1,forest-2} "$building"; do
  for vehicle in builtin:quad-5in builtin:quad-7in; do
    for first in 0 50 100 150; do
      printf '%q ' backwash compare --quiet --threads 1 --scenes "$scene" --vehicle "$vehicle" --flights $flights --seed "$seed" --rows \
        --pairs $first:$((first + 50))
      echo
    done
  done
done >"$campaign.txt"
seq "$(wc -l <"$campaign.txt")" | xargs -P "$(nproc)" -n 1 "$backwash" campaign run "$campaign.txt" -o "$campaign"
"$backwash" campaign merge "$campaign.txt" -o "$campaign"
"$backwash" compare --from "$campaign/rows.jsonl" --flights $flights --seed "$seed" --json >"$out/compare.json"
"$backwash" compare --from "$campaign/rows.jsonl" --flights $flights --seed "$seed" --force \
  --report "$out/compare.html" --out "$out/compare.csv" >"$out/compare.txt"

python3 "$(dirname "${BASH_SOURCE[0]}")/compare_table.py" "$out/compare.json" >"$out/compare.md"
python3 - "$out/compare.json" <<'PYTHON'
import json, sys
found = json.load(open(sys.argv[1]))
first = found["methods"][0]
print(f"{found['common_pairs']} pairs that all methods solve")
for m in found["methods"]:
    c = m["common"]
    print(f"{m['method']:11s} length {c['length_m']:8.1f} m  time {c['time_s']:8.1f} s  jerk2 {c['jerk2']:8.1f}  energy {c['energy_J']/1000:7.2f} kJ"
          f"  contacts {m['contacts']}  no path {m['no_path']} of {m['pairs']}  outside {m['samples_outside']} of {m['samples']}"
          f"  flown {m['flown_m']:.0f} m")
for d in found["demands"]:
    print("met   " if d["met"] else "MISSED", d["text"])
failures = []
if first["contacts"]: failures.append("the proposed method touched something")
if first["samples_outside"]: failures.append("the proposed method left a set")
for m in found["methods"]:
    if m["flown_m"] < 2000: failures.append(f"{m['method']} flew {m['flown_m']:.0f} m, less than 2,000")
for gap in found["narrow_gap"]:
    ratio = max(gap["largest_error_over_bound"].values())
    print(f"narrow gap, {gap['vehicle']}: largest error over bound {ratio:.2f} in {gap['flights']} flights")
    if gap["contacts"] or gap["samples_outside"] or not 0.25 <= ratio <= 1: failures.append(f"narrow gap, {gap['vehicle']}")
sys.exit("; ".join(failures) if failures else 0)
PYTHON
