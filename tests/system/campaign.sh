#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A campaign's answer is a single process's, byte for byte, whatever interrupts it; shards that are missing, doubled, foreign, cut
# short or changed are refused by name.
#   campaign.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" "$here/campaign_rows.py" <<'PYTHON'
import hashlib, json, math, os, pathlib, shutil, signal, subprocess, sys, time

backwash, rows_py = sys.argv[1:]


def say(*arguments, code=0):
    done = subprocess.run([backwash, *arguments], capture_output=True, text=True)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout if code == 0 else done.stderr


def status(folder):
    return json.loads(say("campaign", "status", folder, "--json"))


def planned(name, text):
    pathlib.Path(name + ".toml").write_text(text)
    say("campaign", "plan", name + ".toml", "-o", name)
    return name


def program(name, count, sleep, seconds=60, seed=1, cells='["a", "b c", "d"]'):
    shutil.copy(rows_py, "rows.py")
    return planned(name, f'kind = "program"\nseconds = {seconds}\nshard_seconds = 60\n[program]\n'
                         f'command = ["./rows.py", "{{seed}}", "{{cell}}", "{sleep}"]\nname = "cell"\neach = {cells}\nseed = {seed}\ncount = {count}\n')


def alone(count, seed=1, cells=("a", "b c", "d")):
    """The same rows by the program itself, one after another."""
    return b"".join(subprocess.run([rows_py, str(seed + k), c], capture_output=True, check=True).stdout for k in range(count) for c in cells)


def shards(folder):
    return {p.name: p.read_bytes() for p in pathlib.Path(folder).glob("shard-*.jsonl")}


# The plan: every item once and in order, shards of a minute or more and of nearly one size, hashes as another program finds them.
for seconds in (0.5, 7, 59, 61, 500):
    manifest = json.load(open(planned_at := program(f"cut-{seconds}", 97, 0, seconds) + "/manifest.json"))
    first = manifest["shards"] + [len(manifest["items"])]
    work = [sum(i["seconds"] for i in manifest["items"][a:b]) for a, b in zip(first, first[1:])]
    least = seconds * math.ceil(60 / seconds)  # of whole items
    assert len(work) > 1 and first[0] == 0 and min(work) >= 60 and max(work) < 2 * least and len(work) >= 0.9 * (sum(work) // least), (seconds, work)
    assert manifest["inputs"] == [{"path": "./rows.py", "sha256": hashlib.sha256(open("rows.py", "rb").read()).hexdigest()}]
    assert [i["command"][1:3] for i in manifest["items"][:4]] == [["1", "a"], ["1", "b c"], ["1", "d"], ["2", "a"]]

# One after another, all at once, twice: the same bytes, those of the program itself.
program("small", 4, 0)
say("campaign", "run", "small", "5")
assert say("campaign", "run", "small", "5") == "shard 5 is there already\n"
say("campaign", "run", "small", "--jobs", "3")
before = shards("small")
assert len(before) == 12 and status("small")["done"] == list(range(12))
say("campaign", "merge", "small")
assert pathlib.Path("small/rows.jsonl").read_bytes() == alone(4)
for name in before:
    os.remove("small/" + name)
say("campaign", "run", "small", "--jobs", "1")
assert shards("small") == before
say("campaign", "merge", "small")  # the same bytes need no --force

# What must not be merged, each told by name. Nothing of it is merged, nothing is run over it.
program("other", 4, 0, seed=900)
say("campaign", "run", "other", "--jobs", "2")


def refused(change, *words):
    shutil.rmtree("bad", ignore_errors=True)
    shutil.copytree("small", "bad")
    os.remove("bad/rows.jsonl")
    change(pathlib.Path("bad"))
    said = say("campaign", "merge", "bad", code=65)
    assert said.count("\n") == 1 and said.startswith("backwash campaign merge: bad") and all(w in said for w in words), said
    assert not os.path.exists("bad/rows.jsonl")


def edit(path, old, new):
    text = path.read_bytes()
    assert text.count(old) >= 1
    path.write_bytes(text.replace(old, new, 1))


refused(lambda f: [os.remove(f / f"shard-{k}.jsonl") for k in (2, 3, 7)], "shards 2-3,7 of 0-11 are missing")
refused(lambda f: shutil.copy(f / "shard-4.jsonl", f / "shard-4 (copy).jsonl"), "shard-4 (copy).jsonl", "shard-4.jsonl:1: is shard 4")
refused(lambda f: shutil.copy(f / "shard-4.jsonl", f / "shard-5.jsonl"), "shard-5.jsonl:1: is shard 4", "shard-4.jsonl")
refused(lambda f: shutil.copy("other/shard-6.jsonl", f / "shard-6.jsonl"), "shard-6.jsonl:1: is a shard of another campaign")
for cut in (1, 30, 100, 10**6):  # within the last line, before it, within a row, all of it
    refused(lambda f: (f / "shard-1.jsonl").write_bytes((f / "shard-1.jsonl").read_bytes()[:-cut]), "shard-1.jsonl:1: ")
refused(lambda f: edit(f / "shard-9.jsonl", b'"value": ', b'"value": 1'), "shard-9.jsonl:1: was changed")
refused(lambda f: edit(f / "shard-9.jsonl", b'"shard":9', b'"shard":8'), "shard-9.jsonl")
refused(lambda f: edit(f / "manifest.json", b'"seconds":60.0', b'"seconds":61.0'), "shard-0.jsonl:1: is a shard of another campaign")
refused(lambda f: edit(f / "manifest.json", b'"kind": "program"', b'"kind": "study"'), "manifest.json:1: is no manifest")  # runs a program that no study is
refused(lambda f: edit(f / "manifest.json", b'"version": "', b'"version": "9'), "manifest.json:1: was planned by version 9")
refused(lambda f: (f / "manifest.json").write_text("{}"), "manifest.json:1: is no manifest")

# An input that is another one now; a command that fails, or prints what is no row.
program("late", 1, 0)
edit(pathlib.Path("rows.py"), b"/ 7", b"/ 8")
assert "rows.py:1: is not what it was" in say("campaign", "run", "late", "0", code=65)
assert status("late")["missing"] == [0, 1, 2]
shutil.copy(rows_py, "rows.py")
for name, command, words, code in (("fails", '["sh", "-c", "exit 66"]', "ended with 66", 66), ("talks", '["echo", "hello"]', "no line of JSON", 65),
                                   ("killed", '["sh", "-c", "kill -9 $$"]', "was ended by signal 9", 69), ("none", '["./not-there"]', "not-there:1: cannot be read", 66)):
    pathlib.Path(name + ".toml").write_text(f'kind = "program"\n[program]\ncommand = {command}\n')
    if name == "none":
        assert words in say("campaign", "plan", name + ".toml", "-o", name, code=code)
        continue
    say("campaign", "plan", name + ".toml", "-o", name)
    said = say("campaign", "run", name, "0", code=code)
    assert words in said and status(name)["missing"] == [0] and not os.path.exists(name + "/shard-0.part"), said

# A specification that is wrong is told with its line.
for text, words in (('kind = "bake"\n', ":1: kind must be"), ('kind = "program"\nshard = 3\n[program]\n', ":2: shard is no key"),
                    ('kind = "program"\n[program]\ncommand = "true"\ncount = -1\n', ":4: count must be"),
                    ('kind = "study"\nshard_seconds = 5\n[study]\nfolders = ["."]\n', ":2: shard_seconds must be"), ("kind =\n", ":1: ")):
    pathlib.Path("wrong.toml").write_text(text)
    said = say("campaign", "plan", "wrong.toml", "-o", "wrong", code=78)
    assert said.startswith("backwash campaign plan: wrong.toml" + words), said
    assert not os.path.exists("wrong")
assert "exists already" in say("campaign", "plan", "small.toml", "-o", "small", code=73)

# Power loss: all is killed at once, and what was done is not done again. Two shards at most were lost.
program("loss", 4, 0.8)
for end in (signal.SIGKILL, signal.SIGINT):
    child = subprocess.Popen([backwash, "campaign", "run", "loss", "--jobs", "2"], stderr=subprocess.PIPE, text=True)
    had = len(shards("loss"))
    while len(shards("loss")) < had + 3:
        assert child.poll() is None
        time.sleep(0.02)
    time.sleep(0.2)  # the two at work begin and end together
    found = status("loss")
    assert 1 <= len(found["running"]) <= 2 and found["left_s"] > 0, found
    other = say("campaign", "run", "loss", str(found["running"][-1]), code=69) if end == signal.SIGKILL else ""
    child.send_signal(end)
    said = child.communicate(timeout=10)[1]
    assert child.returncode == (130 if end == signal.SIGINT else -9), said
    assert end == signal.SIGKILL or "shards are done, and stay" in said, said
    time.sleep(0.1)
    left = subprocess.run(["pgrep", "-f", os.getcwd() + "|campaign run loss"], capture_output=True, text=True).stdout
    assert left == "" and status("loss")["running"] == [], left
    kept = {p: p.stat().st_mtime_ns for p in pathlib.Path("loss").glob("shard-*.jsonl")}
    assert had + 3 <= len(kept) < 12
say("campaign", "run", "loss", "--jobs", "2")
assert all(p.stat().st_mtime_ns == t for p, t in kept.items()), "a shard that was done was done again"
say("campaign", "merge", "loss")
assert pathlib.Path("loss/rows.jsonl").read_bytes() == alone(4)

# The verbs themselves: merged is what one process prints.
planned("table", 'kind = "compare"\nseconds = 30\n[compare]\nscenes = ["builtin:corridors", "builtin:narrow-gap"]\nflights = 6\nseed = 3\n')
assert len(status("table")["missing"]) > 3
say("campaign", "run", "table", "--jobs", "2")
say("campaign", "merge", "table")
same = ["compare", "--scenes", "builtin:corridors", "builtin:narrow-gap", "--flights", "6", "--seed", "3"]
assert open("table/result").read() == say(*same, "--untimed", "--json")
assert open("table/rows.jsonl").read() == say(*same, "--rows")
timed = json.loads(say(*same, "--json"))
for method in timed["methods"]:
    method["planning_ms"] = None
assert timed == json.load(open("table/result"))
planned("rooms", 'kind = "feasibility"\n[feasibility]\nmaps = ["builtin:narrow-gap", "builtin:parallel-walls-2m"]\nvehicles = ["builtin:quad-5in"]\n')
say("campaign", "run", "rooms", "--jobs", "1")
say("campaign", "merge", "rooms")
told = [say("feasibility", "--map", m, "--vehicle", "builtin:quad-5in", "--model", "builtin:quad-5in", "--json")
        for m in ("builtin:narrow-gap", "builtin:parallel-walls-2m")]
assert open("rooms/rows.jsonl").read() == "".join(told)

# What would be submitted is printed, and nothing is written.
os.remove("loss/shard-3.jsonl")
files = sorted(os.listdir("loss"))
said = say("campaign", "submit", "loss", "--slurm", "--partition", "day", "--dry-run")
assert "#SBATCH --array=3\n" in said and "sbatch --parsable --partition=day" in said and "--dependency=afterany:" in said, said
said = say("campaign", "submit", "loss", "--parallel", "-j", "4", "--dry-run")
assert said.startswith("parallel --joblog") and said.splitlines()[0].endswith("::: 3") and "--jobs 4" in said, said
assert sorted(os.listdir("loss")) == files
PYTHON
