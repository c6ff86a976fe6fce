#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A small comparison, end to end: the JSON, the CSV and the page agree with each other, a seed repeats itself, and wrong
# arguments are refused.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"

small=(compare --quiet --scenes builtin:narrow-gap --flights 8)
"$backwash" "${small[@]}" --seed 1 --json --out a.csv --report page.html >a.json 2>stderr || die "failed: $(cat stderr)"
[[ ! -s stderr ]] || die "stderr is not empty: $(cat stderr)"
"$backwash" "${small[@]}" --seed 1 --vehicle builtin:quad-7in builtin:quad-5in --out b.csv >table.txt
"$backwash" "${small[@]}" --seed 2 --vehicle builtin:quad-5in --model builtin:quad-5in --out c.csv >/dev/null
grep -q '^tight ' table.txt || die "no row of the table for tight"

# Parts by other processes add up to the whole.
one=("${small[@]}" --seed 1 --vehicle builtin:quad-5in)
"$backwash" "${one[@]}" --rows --pairs 0:3 >rows.jsonl
"$backwash" "${one[@]}" --rows --pairs 3:8 >>rows.jsonl
"$backwash" compare --from rows.jsonl --flights 8 --seed 1 --json >merged.json
"$backwash" "${one[@]}" --untimed --json | cmp - merged.json || die "parts are not the whole"
# Installed, the tool has no such program beside it, and says where it is.
mkdir alone
cp "$backwash" alone/backwash
! alone/backwash compare --flights 1 2>alone.txt || die "compare without its program"
grep -q '^backwash compare: .*build the source tree' alone.txt || die "$(cat alone.txt)"

python3 - <<'PYTHON'
import csv, json, re
rows = {name: list(csv.DictReader(open(name + ".csv"))) for name in "abc"}
key = lambda row: (row["vehicle"], row["method"], int(row["pair"]))
repeatable = lambda rows: sorted((key(r), [v for k, v in r.items() if k != "planning_ms"]) for r in rows)
assert repeatable(rows["a"]) == repeatable(rows["b"]), "the same seed gives other flights"
assert {r["seed"] for r in rows["a"]}.isdisjoint(r["seed"] for r in rows["c"]), "another seed gives the same air"
found = json.load(open("a.json"))
methods = [m["method"] for m in found["methods"]]
assert methods == ["tight", "tight-norm", "paper", "margin-0.1", "margin-0.2", "margin-0.3", "margin-0.4"]
ends = {}  # paired: the same ends and air whatever the method
for r in rows["a"]:
    place = tuple(r[c] for c in ("seed", "start_x_m", "start_y_m", "start_z_m", "goal_x_m", "goal_y_m", "goal_z_m"))
    assert ends.setdefault((r["vehicle"], r["pair"]), place) == place
solved = {m: {(r["vehicle"], r["pair"]): r for r in rows["a"] if r["method"] == m and r["status"] == "ok"} for m in methods}
common = set.intersection(*(set(s) for s in solved.values()))
assert found["common_pairs"] == len(common)
for m in found["methods"]:
    flights = solved[m["method"]]
    assert m["pairs"] == 16 and m["solved"] == len(flights) == 16 - m["no_path"] == m["status"].get("ok", 0)
    assert abs(m["flown_m"] - sum(float(r["flown_m"]) for r in flights.values())) < 1e-6
    assert abs(m["common"]["jerk2"] - sum(float(flights[k]["jerk2"]) for k in common)) < 1e-6
    assert m["contacts"] == sum(int(r["contact_samples"]) > 0 for r in flights.values())
    both = set(flights) & set(solved["tight"])
    ratio = m["first_over_this"]["pairwise"]
    assert ratio["pairs"] == len(both)
    if both:
        expected = sum(float(solved["tight"][k]["jerk2"]) for k in both) / sum(float(flights[k]["jerk2"]) for k in both)
        low, high = ratio["totals"]["jerk2"]["ci95"]
        assert abs(ratio["totals"]["jerk2"]["value"] - expected) < 1e-6 and low <= expected <= high
tight = found["methods"][0]
assert tight["contacts"] == 0 and tight["samples_outside"] == 0 and tight["solved"] > 3
assert [gap["vehicle"] for gap in found["narrow_gap"]] == ["quad-5in", "quad-7in"]
for gap in found["narrow_gap"]:
    assert gap["flights"] == 10 and gap["contacts"] == 0 and gap["samples_outside"] == 0
    assert 0.25 < max(gap["largest_error_over_bound"].values()) < 1, "a bound that is never approached proves nothing"
page = open("page.html").read()
assert page.count("<svg") >= 2 and "</html>" in page
assert not re.search(r'(src|href)\s*=\s*["\']?(https?:|//|file:)', page), "the page refers to something outside itself"
PYTHON

refused() {
  local code=$1 words=$2 got=0
  shift 2
  "$backwash" compare "$@" >stdout 2>stderr || got=$?
  [[ $got == "$code" && $(wc -l <stderr) == 1 ]] && grep -q -- "$words" stderr || die "compare $*: exit $got, $(cat stderr)"
}
mkdir empty
refused 64 "--flights" --flights 0
refused 64 "one --model a --vehicle" --model builtin:quad-5in
refused 66 "no OctoMap" --scenes empty
refused 66 "absent.bt" --scenes builtin:narrow-gap absent.bt
refused 64 "no model of its own" --vehicle vehicle.toml
refused 73 "--force" --out a.csv
