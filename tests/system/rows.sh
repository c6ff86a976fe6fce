#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A study, and a calibration, of what was kept of each log are those of the logs themselves, byte for byte, by whatever shards it was
# kept; rows that are cut short, edited, or of another vehicle, model, map or group are refused by name.
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
for group, more in ([], ["--json"]), ([], ["--quick"]), (["--group", "day"], ["--json", "--quick"]):
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
lines = rows.splitlines(keepends=True)
for cut in (1, 2, 40, 90, 3000):
    refused("study", rows[:-1 - cut], made, "bad.jsonl:13: ")
refused("study", lines[0] + lines[1].replace('"group":0.0', '"group":1.0', 1), made, "bad.jsonl:2: was changed")
at = rows.index('"windows":"') + 5000
refused("study", rows[:at] + ("A" if rows[at] != "A" else "B") + rows[at + 1:], made, "bad.jsonl:1: was changed")
refused("study", "", made, "bad.jsonl:1: is empty")
refused("study", '{"seed": 1}\n', made, "bad.jsonl:1: is no line of it")
refused("study", rows, ["--map", "world/map.bt", "--vehicle", "other/vehicle.toml"], "bad.jsonl:1: was made with another vehicle")
refused("study", rows, ["--map", "world/map.bt", "--vehicle", "world/vehicle.toml", "--model", "builtin:quad-7in"], "another model", "quad-5in", "quad-7in")
refused("study", rows, ["--vehicle", "world/vehicle.toml"], "another map")
refused("study", rows, [*made, "--group", "day"], "another group")
refused("study", rows.replace('"version":"', '"version":"9.', 1), made, "bad.jsonl:1: was changed")
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

# The same as a campaign.
pathlib.Path("fleet.toml").write_text(f'kind = "study"\nseconds = 30\n[study]\nlogs = {json.dumps(logs)}\nmap = "world/map.bt"\n'
                                      'vehicle = "world/vehicle.toml"\nmodel = "builtin:quad-5in"\noptions = ["--quick"]\n')
say("campaign", "plan", "fleet.toml", "-o", "fleet")
assert len(json.load(open("fleet/manifest.json"))["shards"]) >= 4
say("campaign", "run", "fleet", "--jobs", "2")
say("campaign", "merge", "fleet")
assert open("fleet/rows.jsonl").read() == say("study", "--rows", *made, "--log", *logs)
assert open("fleet/result").read() == say("study", *made, "--quick", "--json", "--log", *logs)
pathlib.Path("both.toml").write_text('kind = "study"\n[study]\nlogs = ["world"]\nfolders = ["world"]\n')
assert "both.toml:3: logs is one study" in say("campaign", "plan", "both.toml", "-o", "both", code=78)

# A calibration: logs of two maps.
quad = "builtin:quad-5in"
for name, wall in (("two", 0.7), ("four", 1.7)):
    pathlib.Path(name + ".toml").write_text(f"start = [0, 0, 1.0]\nstrength_sd = 0.35\n[grid]\nlow = [0, {-wall}, 0.35]\nhigh = [0, {wall}, 2.2]\n"
                                            "count = [1, 3, 4]\njitter = 0.03\ndwell = 5.0\n")
    os.mkdir(name)
    for seed in "12":
        say("simulate", "--map", f"builtin:parallel-walls-{2 if name == 'two' else 4}m", "--vehicle", quad, "--flight",
            name + ".toml", "--seed", seed, "--out", f"{name}/{seed}.csv")
walls = ["builtin:parallel-walls-2m", "builtin:parallel-walls-4m"]
here = ["--map", walls[0], "--log", "two/1.csv", "two/2.csv", "--map", walls[1], "--log", "four/1.csv", "four/2.csv"]
fit = ["--vehicle", quad, "--bootstraps", "20"]
pathlib.Path("hovers.jsonl").write_text(say("calibrate", "--rows", "--vehicle", quad, *here[:5]) +
                                        say("calibrate", "--rows", "--vehicle", quad, *here[5:]))
maps = ["--map", walls[0], "--map", walls[1]]
assert say("calibrate", *fit, *maps, "--from", "hovers.jsonl", "--json") == say("calibrate", *fit, *here, "--json")
assert say("calibrate", *fit, *maps, "--from", "hovers.jsonl") == say("calibrate", *fit, *here)
say("calibrate", *fit, *here, "--out", "a.model.toml", "--report", "a.model.html")
say("calibrate", *fit, *maps, "--from", "hovers.jsonl", "--out", "b.model.toml", "--report", "b.model.html")
assert open("a.model.toml").read() == open("b.model.toml").read()
pages = [open(name + ".model.html").read() for name in "ab"]  # each with its command, and equal beside it
own = [page[page.index(">backwash calibrate ") : page.index("</pre>", page.index(">backwash calibrate "))] for page in pages]
assert own[0] != own[1] and pages[0].replace(own[0], "") == pages[1].replace(own[1], "")
flat = ["--vehicle", quad, "--judge", "--json"]
pathlib.Path("flat.jsonl").write_text(say("calibrate", "--rows", "--vehicle", quad, "--log", "two/1.csv", "four/1.csv"))
assert say("calibrate", *flat, "--from", "flat.jsonl") == say("calibrate", *flat, "--log", "two/1.csv", "four/1.csv")
rows = open("hovers.jsonl").read()
refused("calibrate", rows, [*fit, "--map", walls[0]], "bad.jsonl:3: was flown in builtin:parallel-walls-4m")
refused("calibrate", rows, fit, "bad.jsonl:1: was flown in a map")
refused("calibrate", open("flat.jsonl").read(), [*fit, *maps], "bad.jsonl:1: was flown without a map")
refused("calibrate", rows, ["--vehicle", "builtin:quad-7in", *maps], "another vehicle")
refused("calibrate", rows[:-2], [*fit, *maps], "bad.jsonl:4: ")
refused("calibrate", rows.replace('"windows":24', '"windows":25', 1), [*fit, *maps], "bad.jsonl:1: was changed")
refused("calibrate", open("rows.jsonl").read(), [*fit, *maps], "bad.jsonl:1: ")
assert "needs --log or" in say("calibrate", *fit, code=64)
pathlib.Path("walls.toml").write_text(f'kind = "calibrate"\nseconds = 70\n[calibrate]\nlogs = ["two", "four"]\nmaps = {json.dumps(walls)}\n'
                                      f'vehicle = "{quad}"\noptions = ["--bootstraps", "20"]\n')
say("campaign", "plan", "walls.toml", "-o", "walls")
assert len(json.load(open("walls/manifest.json"))["shards"]) >= 2
say("campaign", "run", "walls", "--jobs", "2")
say("campaign", "merge", "walls")
assert open("walls/rows.jsonl").read() == rows and open("walls/result").read() == say("calibrate", *fit, *here, "--json")
pathlib.Path("wrong.toml").write_text('kind = "calibrate"\n[calibrate]\nlogs = ["two"]\nmaps = ["a.bt", "b.bt"]\n')
assert "wrong.toml:4: maps must be none, one, or one for each" in say("campaign", "plan", "wrong.toml", "-o", "wrong", code=78)
PYTHON
