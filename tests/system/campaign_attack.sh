#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A campaign under hostile names, links, edits and orders of events: nothing of the user's is run or overwritten, no row is silently
# missing, doubled or of other inputs, and two who work at once do not get in each other's way.
#   campaign_attack.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" "$here/campaign_rows.py" <<'PYTHON'
import json, os, pathlib, shutil, subprocess, sys, time

backwash, rows_py = sys.argv[1:]
shutil.copy(rows_py, "rows.py")


def say(*arguments, code=0, **more):
    done = subprocess.run([backwash, *arguments], capture_output=True, text=True, errors="replace", **more)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout if code == 0 else done.stderr


def planned(name, keys, top='seconds = 60\n', kind="program", code=0):
    pathlib.Path("spec.toml").write_text(f'kind = "{kind}"\n{top}[{kind}]\n{keys}\n')
    said = say("campaign", "plan", "spec.toml", "-o", name, code=code)
    return said


def work_of(name):
    manifest = json.load(open(name + "/manifest.json"))
    first = manifest["shards"] + [len(manifest["items"])]
    return [sum(i["seconds"] for i in manifest["items"][a:b]) for a, b in zip(first, first[1:])]


ROWS = 'command = ["./rows.py", "{seed}", "a", "%s"]\ncount = %d'

# Minutes of work are never one shard, and two processors have the same of few shards; the plan says so.
for count, expected in ((39, [117]), (40, [60, 60]), (48, [72, 72]), (70, [105, 105]), (100, [75] * 4), (7 * 20, None)):
    said = planned(f"cut-{count}", ROWS % (0, count), "seconds = 3\n")
    work = work_of(f"cut-{count}")
    assert expected is None or work == expected, (count, work)
    assert len(work) == 1 or len(work) % 2 == 0, work
    assert f"{len(work)} shards of about {sum(work) / len(work):.0f} s; estimated {sum(work):.0f} s on one core" in said, said
    assert f"{max(work):.0f} s at best: on {len(work)} cores" in said, said
planned("coarse", ROWS % (0, 3))
assert work_of("coarse") == [60] * 3  # two of them would take two processors as long, and three longer
planned("forest", 'scenes = ["builtin:forest-1"]\nvehicles = ["builtin:quad-5in"]\nflights = 200', "", "compare")
assert max(work_of("forest")) < 1.1 * min(work_of("forest")), work_of("forest")

# Two `run --jobs` of one campaign at once: each shard once, neither fails.
planned("two", ROWS % (0.3, 8))
both = [subprocess.Popen([backwash, "campaign", "run", "two", "--jobs", "2"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in "ab"]
said = [child.communicate(timeout=60) for child in both]
assert [child.returncode for child in both] == [0, 0], said
say("campaign", "merge", "two")
assert [json.loads(line)["seed"] for line in open("two/rows.jsonl")] == list(range(1, 9))

# An input that is edited while a shard is at work, its rows are of two inputs.
pathlib.Path("in.json").write_text('{"v": 1}\n')
planned("edited", 'command = ["sh", "-c", "cat in.json; sleep {seed}"]\ninputs = ["in.json"]')
child = subprocess.Popen([backwash, "campaign", "run", "edited", "0"], stderr=subprocess.PIPE, text=True)
time.sleep(0.4)
pathlib.Path("in.json").write_text('{"v": 2}\n')
said = child.communicate(timeout=20)[1]
assert child.returncode == 65 and "in.json:1: is not what it was" in said, said
assert not [f for f in os.listdir("edited") if f.startswith("shard-")], os.listdir("edited")

# The program of the last command is an input too.
pathlib.Path("last.sh").write_text('#!/bin/sh\nwc -l < "$1"\n')
os.chmod("last.sh", 0o755)
planned("last", ROWS % (0, 2) + '\nlast = ["./last.sh", "{rows}"]')
say("campaign", "run", "last", "--jobs", "2")
say("campaign", "merge", "last")
assert open("last/result").read() == "2\n"
with open("last.sh", "a") as file:
    file.write("echo more\n")
assert "last.sh:1: is not what it was" in say("campaign", "merge", "last", "--force", code=65)

# A folder from elsewhere whose files are links into the user's.
pathlib.Path("precious").write_text("mine\n")
for name in ("shard-0.part", "shard-0.seconds"):
    planned("links-" + name, ROWS % (0, 1))
    os.symlink(os.path.abspath("precious"), f"links-{name}/{name}")
    said = say("campaign", "run", "links-" + name, "0", code=73 if name.endswith("part") else 0)
    assert open("precious").read() == "mine\n", name

# Whatever the folder's name holds is a name: to sh, and to GNU parallel, whose command lines hold Perl.
for name in ("a b", "it's", "$(touch pwned)", '{= system("touch pwned") =}{}{#}', "`touch pwned`\n#SBATCH --wrap=x;touch pwned"):
    planned(name, ROWS % (0, 2))
    if shutil.which("parallel"):
        say("campaign", "submit", name, "--parallel", "-j", "1")
        assert len(open(name + "/rows.jsonl").readlines()) == 2
    assert not os.path.exists("pwned"), name

# Slurm's queue has the array that was submitted before: its shards are missing, and are not submitted again.
os.mkdir("bin")
for program, lines in (("sbatch", 'echo "$@" >>given\necho 77'), ("squeue", "cat queue")):
    path = pathlib.Path("bin", program)
    path.write_text("#!/bin/sh\n" + lines + "\n")
    path.chmod(0o755)
fake = dict(os.environ, PATH=os.path.abspath("bin") + ":" + os.environ["PATH"])
name = "x'y\n$(touch pwned) z"
planned(name, ROWS % (0, 2))
pathlib.Path("queue").write_text("12\n177\n")
say("campaign", "submit", name, "--slurm", env=fake)
pathlib.Path("queue").write_text("12\n77\n77\n")
assert "array 77 is in Slurm's queue" in say("campaign", "submit", name, "--slurm", env=fake, code=69)
pathlib.Path("queue").write_text("")
for task in "0", "1":  # the script itself, as Slurm would run it
    subprocess.run(["sh", name + "/array.sh"], env=dict(os.environ, SLURM_ARRAY_TASK_ID=task), check=True)
subprocess.run(["sh", name + "/merge.sh"], check=True)
assert len(open(name + "/rows.jsonl").readlines()) == 2 and not os.path.exists("pwned")

# What would silently lose or double rows is told before or instead.
planned("silent", 'command = ["true"]')
assert "printed no row" in say("campaign", "run", "silent", "0", code=65)
for keys, words in (('command = ["./rows.py", "1", "a"]\ncount = 2', "count needs {seed}"), ('command = ["echo", "{seed}"]\neach = ["1", "2"]', "each needs {each}"),
                    ('command = ["echo", "{seed}"]\neach = ["1", "2"]\nname = "seed"', "name must be another"),
                    ('command = ["echo", "{seed}"]\nseed = 9223372036854775807', "seed must be"), ('command = ["echo", "{seed}"]\ncount = 0', "count must be"),
                    ('command = ["echo", "{seed}"]\ncount = 1000001', "a million items")):
    assert words in planned("never", keys, code=78), words
    assert not os.path.exists("never")
os.mkdir("logs")
open(b"logs/a\xff.csv", "w").close()
assert "is no UTF-8" in planned("never", 'logs = ["logs"]', "", "adapt", code=65)

# The folder in which commands run is gone; the campaign's own may be moved, and named from anywhere.
os.mkdir("gone")
pathlib.Path("spec.toml").write_text('kind = "program"\n[program]\ncommand = ["echo", "1"]\n')
say("campaign", "plan", "../spec.toml", "-o", "../orphan", cwd="gone")
os.rmdir("gone")
assert "gone:1: is no folder" in say("campaign", "run", "orphan", "0", code=66)
planned("moved", ROWS % (0, 2))
say("campaign", "run", "moved", "1")
os.mkdir("far")
os.rename("moved", "far/moved")
say("campaign", "run", "moved", "--jobs", "1", cwd="far")
say("campaign", "merge", "far/../far/moved")
assert [json.loads(line)["seed"] for line in open("far/moved/rows.jsonl")] == [1, 2]

# Kinds study and adapt: what the verbs print alone, in the order of the logs.
pathlib.Path("flight.toml").write_text('start = [0, 0, 1]\n[[hover]]\np = [1, 0, 1]\ndwell = 6.0\n[[hover]]\np = [0, 0, 0.5]\ndwell = 6.0\n')
quad = ["--map", "builtin:parallel-walls-2m", "--vehicle", "builtin:quad-5in", "--model", "builtin:quad-5in"]
for folder in ("day 1", "day 2"):
    os.mkdir(folder)
    for seed in "12":
        say("simulate", *quad[:4], "--flight", "flight.toml", "--seed", seed + folder[-1], "--out", f"{folder}/f{seed}.csv")
files = 'map = "builtin:parallel-walls-2m"\nvehicle = "builtin:quad-5in"\nmodel = "builtin:quad-5in"'
logs = [f"{folder}/f{k}.csv" for folder in ("day 1", "day 2") for k in "12"]
planned("adapted", 'logs = ["day 1", "day 2"]\n' + files, "", "adapt")
planned("studied", 'folders = ["day 1", "day 2"]\noptions = ["--quick", "--seed", "3"]\n' + files, "", "study")
for name, alone in (("adapted", [["adapt", log, "--json", *quad] for log in logs]),
                    ("studied", [["study", "--json", *quad, "--quick", "--seed", "3", "--log", *logs[k:k + 2]] for k in (0, 2)])):
    say("campaign", "run", name, "--jobs", "2")
    say("campaign", "merge", name)
    assert open(name + "/rows.jsonl").read() == "".join(say(*words) for words in alone), name
PYTHON
