#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A campaign's rows are those of its commands one after another, byte for byte, whatever interrupts it; results that are missing, or
# that another command, program or input made, are refused by name. Names that a shell would run are names.
#   campaign.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" "$here/campaign_rows.py" <<'PYTHON'
import json, os, pathlib, shutil, signal, subprocess, sys, time

backwash, rows_py = sys.argv[1:]
shutil.copy(rows_py, "rows.py")


def say(*arguments, code=0, **more):
    done = subprocess.run([backwash, *arguments], capture_output=True, text=True, errors="replace", **more)
    assert done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout if code == 0 else done.stderr


def commands(name, count=8, sleep=0):
    pathlib.Path(name).write_text("# a line each\n\n" + "".join(f"./rows.py {seed} 'b c' {sleep}\n" for seed in range(1, count + 1)))
    return [name, "-o", name.removesuffix(".txt")]


def results(folder):
    return {p.name: p.read_bytes() for p in pathlib.Path(folder).glob("line-*.jsonl")}


alone = b"".join(subprocess.run([rows_py, str(seed), "b c"], capture_output=True, check=True).stdout for seed in range(1, 9))

# Any lines in any order, twice, by two at once: the same bytes, those of the program itself.
small = commands("small.txt")
say("campaign", "run", *small, "5", "3")
assert set(results("small")) == {"line-5.jsonl", "line-3.jsonl"}
assert "lines 4,6-10 of small.txt are missing" in say("campaign", "merge", *small, code=65)
at = os.stat("small/line-5.jsonl").st_mtime_ns
both = [subprocess.Popen([backwash, "campaign", "run", *small]) for _ in "ab"]
assert [child.wait(60) for child in both] == [0, 0] and os.stat("small/line-5.jsonl").st_mtime_ns == at
assert json.loads(say("campaign", "merge", *small, "--json"))["rows"] == 8
assert pathlib.Path("small/rows.jsonl").read_bytes() == alone
say("campaign", "merge", *small)  # the same bytes need no --force
assert "has no command in these lines" in say("campaign", "run", *commands("task.txt"), "--task", "1", code=64)
say("campaign", "run", *commands("task.txt"), "--task", "4")
assert set(results("task")) == {"line-4.jsonl"}

# A result names what made it; one of another command, input or program is not merged, nor done again unasked.
made = json.loads(results("small")["line-4.jsonl"].splitlines()[0])["made"]
assert made["command"] == ["./rows.py", "2", "b c", "0"] and made["program"] is None and set(made["inputs"]) == {"./rows.py"}, made


def refused(change, *words):
    shutil.rmtree("bad", ignore_errors=True)
    shutil.copytree("small", "bad")
    shutil.copy("small.txt", "bad.txt")
    os.remove("bad/rows.jsonl")
    change(pathlib.Path("bad"))
    for verb in "merge", "run":
        said = say("campaign", verb, "bad.txt", "-o", "bad", code=65)
        assert said.count("\n") == 1 and said.startswith(f"backwash campaign {verb}: bad") and all(w in said for w in words), said
    assert not os.path.exists("bad/rows.jsonl")


refused(lambda f: shutil.copy(f / "line-4.jsonl", f / "line-5.jsonl"), "line-5.jsonl:1: was made with another command")
refused(lambda f: pathlib.Path("bad.txt").write_text(pathlib.Path("bad.txt").read_text().replace("./rows.py 4", "./rows.py 40")),
        "line-6.jsonl:1: was made with another command")
refused(lambda f: (f / "line-9.jsonl").write_text(""), "line-9.jsonl:1: is no result")
refused(lambda f: open("rows.py", "a").write("# edited\n"), "line-3.jsonl:1: was made with another ./rows.py")
shutil.copy(rows_py, "rows.py")
pathlib.Path("own.txt").write_text("backwash reach --vehicle builtin:quad-5in --track track.csv --json\n")
pathlib.Path("track.csv").write_text("t_s,cmd_x_m,cmd_y_m,cmd_z_m,sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz\n" +
                                     "".join(f"0.0{2 * k},1,2,3,0.09,0,0,0.04,0,0.01\n" for k in range(5)))
say("campaign", "run", "own.txt", "-o", "own")
head, row = open("own/line-1.jsonl").read().splitlines()
assert "track.csv" in json.loads(head)["made"]["inputs"] and row + "\n" == say(*"reach --vehicle builtin:quad-5in --track track.csv --json".split())
hash_of = json.loads(head)["made"]["program"]["sha256"]
pathlib.Path("own/line-1.jsonl").write_text(head.replace(hash_of, hash_of[::-1]) + "\n" + row + "\n")
assert "was made with another program" in say("campaign", "merge", "own.txt", "-o", "own", code=65)
# Inputs are files behind --key= too, and those in a folder, which may come later.
os.makedirs("rooms/deeper")
for path, later in (("key", "key"), ("rooms/one", "rooms/one"), ("rooms/one", "rooms/two")):
    shutil.rmtree("inputs", ignore_errors=True)
    pathlib.Path(path).write_text("1")
    pathlib.Path("inputs.txt").write_text("./rows.py 1 --map=key\n./rows.py 1 rooms\n")
    say("campaign", "run", "inputs.txt", "-o", "inputs")
    pathlib.Path("rooms/deeper/three").write_text(later)
    say("campaign", "merge", "inputs.txt", "-o", "inputs")
    pathlib.Path(later).write_text("2")
    assert f"was made with another {later};" in say("campaign", "merge", "inputs.txt", "-o", "inputs", code=65), later

# A command that fails, prints no rows, is none, or whose input is edited while it runs. The other lines are done.
pathlib.Path("in.json").write_text('{"v": 1}\n')
for number, (line, words, code) in enumerate((("sh -c 'exit 66'", "sh ended with 66", 69), ("echo hello", "echo printed no lines of JSON", 65),
                                              ("true", "printed no lines", 65), ("sh -c 'kill -9 $$'", "was ended by signal 9", 69),
                                              ("./not-there", "cannot be run", 69), ("echo 1 | cat", "is no command", 65),
                                              ("echo $(touch pwned)", "is no command", 65), ("echo $NOT_SET", "is no command", 65),
                                              ("sh -c 'cat in.json; echo {} >in.json' in.json", "its in.json changed", 65))):
    pathlib.Path("wrong.txt").write_text(line + "\necho 7\n")
    said = say("campaign", "run", "wrong.txt", "-o", f"wrong{number}", code=code)
    assert said.startswith("backwash campaign run: wrong.txt:1: ") and words in said, said
    assert words == "is no command" or set(results(f"wrong{number}")) == {"line-2.jsonl"}, said
say("campaign", "run", "none.txt", "-o", "none", code=66)

# What is killed loses the line at work.
loss = commands("loss.txt", sleep=0.5)
child = subprocess.Popen([backwash, "campaign", "run", *loss])
while len(results("loss")) < 2:
    time.sleep(0.02)
child.send_signal(signal.SIGKILL)
child.wait()
kept = {p: p.stat().st_mtime_ns for p in pathlib.Path("loss").iterdir()}
assert 2 <= len(kept) < 8
say("campaign", "run", *loss)
assert all(p.stat().st_mtime_ns == t for p, t in kept.items())
say("campaign", "merge", *loss)
assert len(open("loss/rows.jsonl").readlines()) == 8

# Slurm is given the lines that are missing, and a merge after them; the scripts run nothing that a name holds.
os.mkdir("bin")
pathlib.Path("bin/sbatch").write_text('#!/bin/sh\necho "$@" >>given\necho 77\n')
os.chmod("bin/sbatch", 0o755)
fake = dict(os.environ, PATH=os.path.abspath("bin") + ":" + os.environ["PATH"])
for name in ("a b", "it's", "`touch pwned`\n#SBATCH --wrap=x;touch pwned", "$(touch pwned)"):
    commands("names.txt", 2)
    said = say("campaign", "submit", "names.txt", "-o", name, "--partition", "day", "--dry-run")
    assert "--array=3-4\n" in said and "sbatch --parsable --partition=day" in said and "--dependency=afterany:JOB" in said, said
    assert not [f for f in os.listdir(name)]
    assert say("campaign", "submit", "names.txt", "-o", name, env=fake) == "array 77 of 2 lines, merge 77 after it\n"
    for task in "3", "4":  # the script itself, as Slurm would run it
        subprocess.run(["sh", name + "/array.sh"], env=dict(os.environ, SLURM_ARRAY_TASK_ID=task), check=True)
    subprocess.run(["sh", name + "/merge.sh"], check=True)
    assert len(open(name + "/rows.jsonl").readlines()) == 2 and not os.path.exists("pwned")
    assert "misses no line" in say("campaign", "submit", "names.txt", "-o", name, code=64)
PYTHON
