#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwash adapt` on logs that lack something: without an attitude the class is none, and it is said; at 10 Hz each sample counts for as
# long as it stood; accelerations change nothing, an offset is named; a number that is none is refused by its line.
#   adapt.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
printf 'start = [0, 0, 1]\n[[hover]]\np = [1, 0, 1]\ndwell = 40.0\n' >spec.toml
"$backwash" simulate --map builtin:parallel-walls-4m --vehicle builtin:quad-5in --flight spec.toml --out whole.csv >/dev/null
python3 - "$backwash" <<'PYTHON'
import csv, json, subprocess, sys

header, *rows = csv.reader(open("whole.csv"))


def adapt(name, keep=lambda column: True, rows=rows, code=0):
    columns = [k for k, column in enumerate(header) if keep(column)]
    with open(name, "w", newline="") as file:
        csv.writer(file).writerows([row[k] for k in columns] for row in [header, *rows])
    ran = lambda *more: subprocess.run([sys.argv[1], "adapt", name, "--map", "builtin:parallel-walls-4m", "--vehicle",
                                        "builtin:quad-5in", "--quiet", *more], capture_output=True, text=True)
    text, told = ran(), ran("--json")
    assert text.returncode == told.returncode == code, (name, text.returncode, text.stderr)
    return (json.loads(told.stdout)["logs"][0], text.stdout) if code == 0 else text.stderr


rate = (len(rows) - 1) / (float(rows[-1][0]) - float(rows[0][0]))
whole, text = adapt("all.csv")
classes = {c["class"]: c["seconds"] for c in whole["classes"]}
assert whole["attitude"] and "none" not in classes and sum(classes.values()) > 30, whole
assert "no attitude" not in text

bare, text = adapt("bare.csv", lambda column: not column.startswith("q"))
assert not bare["attitude"] and [c["class"] for c in bare["classes"]] == ["none"] and "no attitude, so no class" in text, (bare, text)
assert abs(bare["classes"][0]["seconds"] - sum(classes.values())) < 5, "what has no class is learnt all the same"

slow, _ = adapt("slow.csv", rows=rows[::round(rate / 10)])
assert abs(slow["samples"] * rate / 10 / whole["samples"] - 1) < 0.1, (rate, slow["samples"], whole["samples"])
assert abs(sum(c["seconds"] for c in slow["classes"]) / sum(classes.values()) - 1) < 0.2, (slow, classes)

# Errors are asked: no accelerometer, and a constant part is named.
assert [c["cause"] for c in whole["classes"]] == ["none"] * len(classes) and all(c["beyond"] < 5 for c in whole["classes"]), whole
shaken = [[str(50 * (-1) ** k) if name in ("ax_mps2", "ay_mps2", "az_mps2") else cell for name, cell in zip(header, row)]
          for k, row in enumerate(rows)]
assert adapt("shaken.csv", rows=shaken)[0]["classes"] == whole["classes"]
sunk = [[str(float(cell) - 0.05) if name == "z_m" else cell for name, cell in zip(header, row)] for row in rows]
low, text = adapt("sunk.csv", rows=sunk)
assert low["classes"][0]["cause"] == "constant" and low["classes"][0]["factor"] > 1 and "most of it is constant" in text, (low, text)

column = header.index("vx_mps")
for bad in ("nan", "inf", ""):
    wrong = [list(row) for row in rows]
    wrong[100][column] = bad
    said = adapt("wrong.csv", rows=wrong, code=65)
    assert "wrong.csv:102" in said, said
PYTHON
