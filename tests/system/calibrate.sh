#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# From simulated hover flights to a model file that other verbs read, and the refusal of what the flights cannot tell.
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
quad=builtin:quad-5in

grid() { printf 'start = [0, 0, 1.0]\nstrength_sd = 0.35\n[grid]\nlow = %s\nhigh = %s\ncount = %s\njitter = 0.03\ndwell = 5.0\n' "$1" "$2" "$3"; }
grid '[0, -0.7, 0.35]' '[0, 0.7, 2.2]' '[1, 3, 4]' >two.toml
grid '[0, -1.7, 0.35]' '[0, 1.7, 2.2]' '[1, 3, 4]' >four.toml
grid '[0, -0.1, 0.9]' '[0, 0.1, 1.0]' '[1, 3, 3]' >poor.toml
for seed in 1 2 3; do
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
"$backwash" calibrate --map builtin:parallel-walls-4m --log poor1.csv poor2.csv poor3.csv --vehicle $quad --out none.toml --json \
  >refused.json 2>stderr || status=$?
[[ $status == 65 && ! -e none.toml && $(wc -l <stderr) == 1 ]] || die "refusal: exit $status, $(cat stderr)"
grep -q 'wall refused: no wall closer.*to determine it, hover' stderr || die "the refusal's line: $(cat stderr)"
"$backwash" calibrate --map builtin:parallel-walls-4m --log poor1.csv poor2.csv poor3.csv --vehicle $quad --keep-base --bootstraps 20 --report kept.html >log 2>stderr ||
  die "--keep-base: $(cat stderr)"
# A model that no program reads is not written, and the key that is at fault is told.
for log in two1 two2 four1 four2; do
  awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i ~ /^a[xyz]_mps2$/) loud[i] } NR > 1 { for (i in loud) $i *= 1e4 } 1' $log.csv >loud_$log.csv
done
status=0
"$backwash" calibrate --map builtin:parallel-walls-2m --log loud_two1.csv loud_two2.csv --map builtin:parallel-walls-4m --log loud_four1.csv \
  loud_four2.csv --vehicle $quad --bootstraps 20 --out loud.toml >log 2>stderr || status=$?
[[ $status == 65 && ! -e loud.toml ]] && grep -q "loud.toml:[0-9]*: key 'base.horizontal' = .*needs a number" stderr || die "unreadable model: exit $status, $(cat stderr)"
# Flights in another room are left out; alone they are an error.
"$backwash" calibrate --map builtin:parallel-walls-1m --log two1.csv --map builtin:parallel-walls-4m --log four2.csv --vehicle $quad --judge --json >room.json 2>stderr ||
  die "another room: $(cat stderr)"
python3 - <<'PYTHON'
import json
told = json.load(open("room.json"))
assert next(iter(told)) == "map_shares" and told["flights"] == 1 and [left["log"] for left in told["left_out"]] == ["two1.csv"]
wrong, right = told["map_shares"]
assert wrong["inside"] > 0.1 and wrong["outside"] > 0.1 and right == {"log": "four2.csv", "map": "builtin:parallel-walls-4m", "inside": 0, "too_near": 0, "outside": 0}
PYTHON
status=0
"$backwash" calibrate --map builtin:parallel-walls-1m --log two1.csv --vehicle $quad --judge >log 2>stderr || status=$?
[[ $status == 65 ]] && grep -q 'two1.csv:1: lies where the map lets no craft be: .*first at t_s' stderr || die "another room alone: exit $status, $(cat stderr)"
# A study takes several maps in the same way, each flight judged by its own, from logs or from rows.
rooms=(--vehicle $quad --map builtin:parallel-walls-2m --log two1.csv two2.csv --map builtin:parallel-walls-4m --log four1.csv four2.csv)
"$backwash" study --rows "${rooms[@]}" >rooms.jsonl && "$backwash" study "${rooms[@]}" --quick --json >rooms.json &&
  "$backwash" study --vehicle $quad --map builtin:parallel-walls-4m --map builtin:parallel-walls-2m --from rooms.jsonl --quick --json >from.json &&
  "$backwash" study --vehicle $quad --map builtin:parallel-walls-4m --log two1.csv --map builtin:parallel-walls-2m --log four1.csv --log two2.csv --json >changed.json 2>stderr || die "study of two rooms: $(cat stderr)"
cmp rooms.json from.json || die "rows of two rooms are another study"
python3 - <<'PYTHON'
import json
told, changed = json.load(open("rooms.json")), json.load(open("changed.json"))
assert [(share["log"], share["map"][-2:]) for share in told["map_shares"]] == [("two1.csv", "2m"), ("two2.csv", "2m"), ("four1.csv", "4m"), ("four2.csv", "4m")]
assert told["flights"] == 4 and all(share["inside"] + share["too_near"] + share["outside"] == 0 for share in told["map_shares"])
assert changed["flights"] == 2, changed
assert [left["log"] for left in changed["left_out"]] == ["four1.csv"]
assert changed["map_shares"][1]["outside"] > 0.1 and "parallel-walls-2m" in changed["left_out"][0]["why"]
PYTHON
status=0
"$backwash" study two1.csv "${rooms[@]}" >log 2>stderr || status=$?
[[ $status == 64 ]] && grep -q 'two1.csv follows no --map, as others do' stderr || die "a log without its map: exit $status, $(cat stderr)"
status=0
"$backwash" study --log two1.csv --map builtin:parallel-walls-4m --log four1.csv four2.csv --vehicle $quad --quick >log 2>stderr || status=$?
[[ $status == 64 ]] && grep -q 'two1.csv follows no --map, as others do' stderr || die "a log before the only map: exit $status, $(cat stderr)"
# Logs without a map: a page of a flat floor.
"$backwash" calibrate --log poor1.csv poor2.csv two1.csv --vehicle $quad --keep-base --bootstraps 20 --report flat.html >log 2>stderr || die "without a map: $(cat stderr)"

# Three flights to a vehicle file, and what refuses them.
sed 's|horizontal = 10.0, vertical = 12.0|horizontal = 7.0, vertical = 9.0|; s|attitude_lag = 0.05|attitude_lag = 0.07|' <("$backwash" vehicle print $quad) >other.toml
printf 'start = [0, 0, 1]\n[grid]\nlow = [-1.5, -1.2, 0.5]\nhigh = [1.5, 1.2, 1.7]\ncount = [2, 2, 2]\njitter = 0.1\ndwell = 4.0\n' >around.toml
printf 'start = [0, 0, 1]\n[grid]\nlow = [0, 0, 1]\nhigh = [0, 0, 1]\ncount = [1, 1, 1]\njitter = 0\ndwell = 40.0\n' >hover.toml
for flight in around:1 around:2 around:3 hover:4; do
  "$backwash" simulate --map builtin:parallel-walls-4m --vehicle other.toml --model $quad --flight ${flight%:*}.toml --seed ${flight#*:} --out $flight.csv >log
done
"$backwash" vehicle fit around:?.csv --vehicle $quad --out proposed.toml --json >keys.json 2>stderr || die "vehicle fit: $(cat stderr)"
sed "s|^kp = .*|$(grep '^kp' proposed.toml)|; s|^kd = .*|$(grep '^kd' proposed.toml)|; s|^latency = .*|$(grep '^latency' proposed.toml)|; s|^attitude_lag = .*|$(grep '^attitude_lag' proposed.toml)|" other.toml >again.toml
"$backwash" vehicle check --vehicle again.toml >log || die "what is proposed is no vehicle file"
# One short log and one that excites nothing stop no fit of three others.
awk -F, -v OFS=, 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == "x_m") x = i } NR > 1 { $x += 0.01 } NR <= 250' around:1.csv >short.csv
"$backwash" vehicle fit around:?.csv short.csv hover:4.csv --vehicle $quad --json >more.json 2>stderr || die "vehicle fit with a short log: $(cat stderr)"
"$backwash" vehicle fit around:?.csv around:1.csv --vehicle $quad --json >/dev/null 2>twice || die "vehicle fit with a flight twice: $(cat twice)"
grep -q 'around:1.csv:1: 100 % of the positions are those of around:1.csv: .*; left out' twice || die "twice: $(cat twice)"
grep -q 'short.csv:1: holds less than 10 s in the air that can be used; left out' stderr && grep -q 'hover:4.csv does not excite .*; left out' stderr || die "not told: $(cat stderr)"
python3 -c 'import json; few, more = json.load(open("keys.json")), json.load(open("more.json")); assert few["keys"] == more["keys"] and len(more["left_out"]) == 2'
status=0
"$backwash" vehicle fit around:1.csv around:2.csv hover:4.csv --vehicle $quad --out none.toml >log 2>stderr || status=$?
[[ $status == 65 && ! -e none.toml ]] && grep -q 'hover:4.csv does not excite controller.latency: fly' stderr && ! grep -q 'around:..csv does not excite' stderr ||
  die "hover: exit $status, $(cat stderr)"
status=0
"$backwash" vehicle fit around:1.csv around:2.csv --vehicle $quad >log 2>stderr || status=$?
[[ $status == 64 ]] && grep -q 'three logs' stderr || die "two logs: exit $status, $(cat stderr)"
python3 - <<'PYTHON'
import json
told = json.load(open("keys.json"))
assert told["level_by"] == "attitude" and told["vertical_by"] == "thrust" and not told["unexcited"] and len(told["logs"]) == 3
right = {"controller.kp.horizontal": 7, "controller.kp.vertical": 9, "controller.kd.horizontal": 5.5, "controller.kd.vertical": 6, "controller.latency": 0.02, "controller.attitude_lag": 0.07}
assert set(told["keys"]) == set(right)
for key, value in right.items():
    low, high = told["keys"][key]["ci90"]
    assert low <= value <= high and abs(told["keys"][key]["value"] - value) < 0.1 * value + 0.015 * (value < 0.1), (key, told["keys"][key])
assert told["keys"]["controller.kp.horizontal"]["ci90"][1] < 9 < 10 == told["keys"]["controller.kp.horizontal"]["file"]
PYTHON

python3 - <<'PYTHON'
import html, json, re
fit, refused = json.load(open("fit.json")), json.load(open("refused.json"))
assert fit["flights"] == 4 and fit["windows"] == 96 and fit["signal"].startswith("acceleration beyond")
for name, value in fit["parameters"].items():
    assert value["ci95"][0] <= value["value"] <= value["ci95"][1], name
assert len(fit["parameters"]) == 14 and len(fit["held_out"]["flights"]) == 4
names = {r["what"] for r in refused["refused"]}
assert "ground" in names and "wall" in names and "parameters" not in refused
page = open("page.html").read()
# The page says what the JSON says: coverage by bin and by flight, each constant with its interval.
told = re.sub(r"<[^>]+>", " ", re.sub(r"</t[hd]>", "|", page.split("<svg")[0]))
for which in ("by_wall_distance", "by_height"):
    assert len(fit["held_out"][which]) >= 4
    for b in fit["held_out"][which]:
        shares = " ".join(rf"{b['coverage'][a]:.2f}\s*\|\s*" for a in "xyz") if b["windows"] else r"–\s*\|\s*" * 3
        high = f"to {b['high_m']:.2f}" if b["high_m"] is not None else "and more"
        assert re.search(rf"{b['low_m']:.2f} {high}\s*\|\s*{b['windows']}\s*\|\s*" + shares.replace(" ", ""), told), (which, b)
for f in fit["held_out"]["flights"]:
    assert re.search(rf"{f['log']}\s*\|\s*{f['windows']}\s*\|\s*{f['coverage']['x']:.2f}", told), f
for name, value in fit["parameters"].items():
    assert re.search(re.escape(name) + r"\s*\|\s*" + re.escape(f"{value['value']:.4g}") + r"\s*\|\s*" + re.escape(f"{value['ci95'][0]:.4g} … {value['ci95'][1]:.4g}"), told), (name, value)
assert f"{fit['held_out']['coverage']['x']:.2f} of the windows lay below the bound along x" in told and "Not determined" not in told
kept = open("kept.html").read()
assert "Not determined" in kept and all(html.escape(r["flight"]) in kept for r in refused["refused"])
flat = open("flat.html").read()
assert "a flat floor" in flat
assert page.count("<svg") == 6 and not re.search(r'(src|href)\s*=\s*["\']?(https?:|//|file:)', page)
PYTHON
