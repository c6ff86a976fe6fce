#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# One flight through the apartment, end to end: passes as it is, and is caught when judged with sets of a variance 25
# times too small.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"

"$backwash" fly --map builtin:apartment --seed 1 --json --report flight.html --log flight.csv >flight.json 2>stderr ||
  die "the flight failed: $(cat stderr)"
[[ ! -s stderr ]] || die "stderr is not empty: $(cat stderr)"
status=0
"$backwash" fly --map builtin:apartment --seed 1 --sigma-scale 0.04 --json >mutant.json 2>stderr || status=$?
[[ $status == 1 ]] || die "the mutant's exit code is $status"
[[ $(wc -l <stderr) == 1 ]] && grep -q 'samples lay outside' stderr || die "the mutant's line: $(cat stderr)"

# A vehicle that ships flies with its own model, and not with the 5-inch one's.
for model in "" "--model builtin:quad-7in" "--model builtin:quad-5in"; do
  "$backwash" fly --map builtin:narrow-gap --vehicle builtin:quad-7in $model --json >"seven${model#*:}.json" 2>stderr ||
    [[ $? == 1 ]] || die "the flight of quad-7in failed: $(cat stderr)"
done
python3 - <<'PYTHON' || die "quad-7in is not flown with its own model"
import json
default, own, other = (json.load(open(f"seven{name}.json"))["tight"]["largest_half_axis_m"] for name in ("", "quad-7in", "quad-5in"))
assert default == own != other, (default, own, other)
PYTHON

python3 - <<'PYTHON'
import csv, json, re
flight, mutant = json.load(open("flight.json")), json.load(open("mutant.json"))
assert flight["ok"] and flight["goal_reached"] and not flight["touched"]
assert flight["samples"] == flight["samples_inside"] > 500
assert 0 < flight["planned_clearance_m"] and 0 < flight["min_clearance_m"]
ratio = max(flight["largest_error_over_bound"].values())
assert 0.2 < ratio < 1, f"largest |e|/h is {ratio}: a bound that is never approached proves nothing"
assert not mutant["ok"] and mutant["samples_inside"] < mutant["samples"]
rows = list(csv.DictReader(open("flight.csv")))
assert len(rows) == flight["samples"] - 1
assert all(abs(float(b["t_s"]) - float(a["t_s"]) - 0.02) < 1e-9 for a, b in zip(rows, rows[1:]))
end = [float(rows[-1][c]) for c in ("x_m", "y_m", "z_m")]
assert max(abs(a - b) for a, b in zip(end, flight["goal"])) < 0.3
page = open("flight.html").read()
assert page.count("<svg") == 7 and "</html>" in page
assert not re.search(r'(src|href)\s*=\s*["\']?(https?:|//|file:)', page), "the report refers to something outside itself"
PYTHON
