#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A study of what was kept of each log is that of the logs themselves, byte for byte, in whatever parts it was
# kept; rows that are cut short, or of another program, vehicle, model, map or group are refused by name.
#   rows.sh BACKWASH STUDY_WORLDS
worlds=$2
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
"$worlds" --out world --seed 11 --cause wall_attraction --flights 12 >truth.json
"$worlds" --out other --seed 12 --flights 1 >>truth.json
python3 - "$backwash" <<'PYTHON'
import glob, json, os, pathlib, shutil, subprocess, sys

backwash = sys.argv[1]


def say(*arguments, code=0):
    done = subprocess.run([backwash, *arguments], capture_output=True, text=True)
    assert done.returncode == code, (arguments, done.returncode, done.stdout[-300:], done.stderr)
    return done.stdout if code == 0 else done.stderr


logs = sorted(glob.glob("world/*.csv"))
# One flight twice: cut to its second half under another name, it is told and counted once.
text = open(logs[3]).read().splitlines(keepends=True)
pathlib.Path("world/again.csv").write_text(text[0] + "".join(text[len(text) // 2:]))
# Two groups of flights; the last ones first, so that their order is that of the groups.
for n, path in enumerate(logs + ["world/again.csv"]):
    rows = open(path).read().splitlines()
    pathlib.Path(path).write_text("".join(row + (",day" if k == 0 else f",{(n + 5) % 6}") + "\n" for k, row in enumerate(rows)))
logs.insert(7, "world/again.csv")
made = ["--map", "world/map.bt", "--vehicle", "world/vehicle.toml", "--model", "builtin:quad-5in"]

# By three processes, in any order, put together in the order of the logs.
for group, more in ([], ["--json"]), (["--group", "day"], ["--json", "--quick"]), ([], ["--quick"]):
    parts = {first: say("study", "--rows", *made, *group, "--log", *logs[first:first + 5]) for first in (10, 0, 5)}
    assert [part.count("\n") for part in parts.values()] == [3, 5, 5]
    pathlib.Path("rows.jsonl").write_text("".join(parts[first] for first in (0, 5, 10)))
    alone = say("study", *made, *group, *more, "--log", *logs)
    assert say("study", *made, *group, *more, "--from", "rows.jsonl") == alone, (group, more)
    assert "again.csv" in alone  # counted once
    assert group or "wall_attraction" in alone, alone
    if group:
        assert json.loads(alone)["groups"] == {"by": "day", "count": 6}
        shutil.copy("rows.jsonl", "grouped.jsonl")
say("study", *made, "--log", *logs, "--quick", "--out", "a.toml", "--report", "a.html")
say("study", *made, "--from", "rows.jsonl", "--quick", "--out", "b.toml", "--report", "b.html")
assert open("a.toml").read() == open("b.toml").read() and open("a.html").read() == open("b.html").read()


def refused(verb, rows, options, *words, code=65):
    pathlib.Path("bad.jsonl").write_text(rows)
    said = say(verb, *options, "--from", "bad.jsonl", "--json", code=code)
    assert said.count("\n") == 1 and all(word in said for word in words), said


rows = open("rows.jsonl").read()
for cut in (1, 2, 40, 90, 3000):
    refused("study", rows[:-1 - cut], made, "bad.jsonl:13: ")
refused("study", "", made, "bad.jsonl:1: is empty")
refused("study", '{"seed": 1}\n', made, "bad.jsonl:1: is no line of it")
refused("study", rows, ["--map", "world/map.bt", "--vehicle", "other/vehicle.toml"], "bad.jsonl:1: was made with another vehicle")
refused("study", rows, ["--map", "world/map.bt", "--vehicle", "world/vehicle.toml", "--model", "builtin:quad-7in"], "another model", "quad-5in", "quad-7in")
refused("study", rows, ["--vehicle", "world/vehicle.toml"], "another map")
refused("study", rows, [*made, "--group", "day"], "another group")
refused("study", rows.replace('"version":"', '"version":"9.', 1), made, "bad.jsonl:1: was made with another version")
refused("study", open("grouped.jsonl").read(), made, "another group")
refused("study", rows, [*made, "--log", logs[0]], "--from takes the place of --log", code=64)
for extra in (["--json"], ["--report", "c.html"], ["--out", "c.toml"]):
    assert "--rows studies nothing" in say("study", "--rows", *made, "--log", logs[0], *extra, code=64)
assert "--residuals needs the logs" in say("study", *made, "--from", "rows.jsonl", "--residuals", "--report", "c.html", code=64)
assert not os.path.exists("c.html")

# Without a map, too.
bare = ["--vehicle", "world/vehicle.toml"]
pathlib.Path("bare.jsonl").write_text(say("study", "--rows", *bare, "--log", *logs))
assert say("study", *bare, "--quick", "--json", "--from", "bare.jsonl") == say("study", *bare, "--quick", "--json", "--log", *logs)

# The same as a campaign: three logs a line.
pathlib.Path("fleet.txt").write_text("".join(f"backwash study --rows {' '.join(made)} --log {' '.join(logs[k:k + 3])}\n" for k in range(0, len(logs), 3)))
say("campaign", "run", "fleet.txt", "-o", "fleet")
say("campaign", "merge", "fleet.txt", "-o", "fleet")
assert open("fleet/rows.jsonl").read() == say("study", "--rows", *made, "--log", *logs)
assert say("study", *made, "--quick", "--json", "--from", "fleet/rows.jsonl") == say("study", *made, "--quick", "--json", "--log", *logs)
PYTHON
