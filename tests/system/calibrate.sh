#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From simulated hover flights to a model file that other verbs read, and the refusal of what the flights cannot tell.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
quad=builtin:quad-5in

grid() { printf 'start = [0, 0, 1.0]\nstrength_sd = 0.35\n[grid]\nlow = %s\nhigh = %s\ncount = %s\njitter = 0.03\ndwell = 5.0\n' "$1" "$2" "$3"; }
grid '[0, -0.7, 0.35]' '[0, 0.7, 2.2]' '[1, 3, 4]' >two.toml
grid '[0, -1.7, 0.35]' '[0, 1.7, 2.2]' '[1, 3, 4]' >four.toml
grid '[0, -0.1, 0.9]' '[0, 0.1, 1.0]' '[1, 3, 3]' >poor.toml
for seed in 1 2; do
  "$backwash" simulate --map builtin:parallel-walls-2m --vehicle $quad --flight two.toml --seed $seed --out two$seed.csv >log
  "$backwash" simulate --map builtin:parallel-walls-4m --vehicle $quad --flight four.toml --seed $seed --out four$seed.csv >log
  "$backwash" simulate --map builtin:parallel-walls-4m --vehicle $quad --flight poor.toml --seed $seed --out poor$seed.csv >log
done
"$backwash" calibrate --map builtin:parallel-walls-2m --log two1.csv two2.csv --map builtin:parallel-walls-4m --log four1.csv \
  four2.csv --vehicle $quad --bootstraps 20 --out model.toml --report page.html --json >fit.json 2>stderr || die "$(cat stderr)"
"$backwash" field --map builtin:apartment --model model.toml --at 3,4,1 --json >field.json || die "the model file is not read"
status=0
"$backwash" calibrate --map builtin:parallel-walls-2m --log two1.csv two2.csv --vehicle $quad --out model.toml 2>stderr || status=$?
[[ $status == 73 ]] || die "overwrites a model file, exit $status"
status=0
"$backwash" calibrate --map builtin:parallel-walls-4m --log poor1.csv poor2.csv poor1.csv --vehicle $quad --out none.toml --json \
  >refused.json 2>stderr || status=$?
[[ $status == 65 && ! -e none.toml && $(wc -l <stderr) == 1 ]] || die "refusal: exit $status, $(cat stderr)"
grep -q 'wall refused: no wall closer.*to determine it, hover' stderr || die "the refusal's line: $(cat stderr)"

python3 - <<'PYTHON'
import json, re
fit, refused = json.load(open("fit.json")), json.load(open("refused.json"))
assert fit["flights"] == 4 and fit["windows"] == 96 and fit["signal"].startswith("acceleration beyond")
for name, value in fit["parameters"].items():
    assert value["ci95"][0] <= value["value"] <= value["ci95"][1], name
assert len(fit["parameters"]) == 14 and len(fit["held_out"]["flights"]) == 4
names = {r["what"] for r in refused["refused"]}
assert "ground" in names and "wall" in names and "parameters" not in refused
page = open("page.html").read()
assert page.count("<svg") == 3 and not re.search(r'(src|href)\s*=\s*["\']?(https?:|//|file:)', page)
PYTHON
