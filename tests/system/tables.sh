#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Tables of strangers: what `import --propose` makes of their headers is the flight that is in them, or is asked by the key that it needs.
#   tables.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" <<'PYTHON'
import csv, datetime, math, subprocess, sys

backwash = sys.argv[1]


def run(*words):
    ran = subprocess.run([backwash, *words], capture_output=True, text=True)
    return ran.returncode, ran.stdout + ran.stderr


def place(t):
    return math.sin(t), 0.7 * math.cos(1.3 * t), 1 + 0.2 * math.sin(2 * t)


def table(header, row, rows=600, separator=","):
    with open("f.csv", "w") as file:
        if header:
            file.write(header + "\n")
        file.writelines(separator.join(f"{c:.7g}" if isinstance(c, float) else str(c) for c in row(0.01 * k)) + "\n" for k in range(rows))


def proposed(world='world = "enu"\n', *more):
    code, text = run("import", "--propose", "f.csv", *more)
    assert code == 0, text
    open("map.toml", "w").write(text.replace("[frame]\n", "[frame]\n" + world))
    return text


def flown(what):
    code, text = run("import", "--map-columns", "map.toml", "f.csv", "-o", "logs", "--force")
    assert code == 0, (what, text, open("map.toml").read())
    rows = list(csv.DictReader(open("logs/f.csv")))
    assert len(rows) > 560, (what, len(rows), text)
    for r in rows[::29]:
        for axis, is_at in zip("xyz", place(float(r["t_s"]))):
            assert abs(float(r[axis + "_m"]) - is_at) < 1e-4, (what, r, open("map.toml").read())


begin = datetime.datetime(2024, 8, 23, 23, 59, 58)
date = lambda t: (begin + datetime.timedelta(seconds=t)).isoformat(" ", "milliseconds")
inch = 0.0254
for what, header, row, separator in [
    ("centimetres in the name", "time_ms,x_cm,y_cm,z_cm", lambda t: (1000 * t, *(100 * p for p in place(t))), ","),
    ("inches in brackets", "t (s),x (in),y (in),z (in)", lambda t: (t, *(p / inch for p in place(t))), ","),
    ("feet spelt out", "stamp [ms];pos_x [feet];pos_y [feet];pos_z [feet]", lambda t: (1000 * t, *(p / 12 / inch for p in place(t))), ";"),
    ("an object of QTM", "Frame\tTime\tdrone X\tdrone Y\tdrone Z\tResidual", lambda t: (round(100 * t), t, *place(t), 0.1), "\t"),
    ("dates over midnight", ",x,y,z", lambda t: (date(t), *place(t)), ","),
    ("dates with a T", "time,px,py,pz", lambda t: (date(t).replace(" ", "T") + "Z", *place(t)), ","),
]:
    table(header, row, separator=separator)
    assert "give frame.world" in proposed(""), what
    code, text = run("import", "--map-columns", "map.toml", "f.csv", "-o", "logs", "--force")
    assert code == 65 and "give frame.world" in text, (what, text)
    proposed()
    flown(what)

# Two objects: which is the craft?
table("Time,drone X,drone Y,drone Z,box X,box Y,box Z", lambda t: (t, *place(t), 0.0, 0.0, 0.0))
assert run("import", "--propose", "f.csv") [0] == 65
proposed('world = "enu"\n', "--columns", "t,x,y,z,-,-,-")
flown("named")

# Millimetres that nothing states.
table("Time,drone X,drone Y,drone Z", lambda t: (t, *(1000 * p for p in place(t))))
proposed()
code, text = run("import", "--map-columns", "map.toml", "f.csv", "-o", "logs", "--force")
assert code == 65 and "mm" in text and "as no multirotor does" in text, text

# KITTI has no times, TUM no header.
table("", lambda t: (1.0, 0.0, 0.0, place(t)[0], 0.0, 1.0, 0.0, place(t)[1], 0.0, 0.0, 1.0, place(t)[2]), separator=" ")
code, text = run("import", "--propose", "f.csv")
assert code == 65 and "paste -d' ' times.txt" in text, text
table("", lambda t: (t, *place(t), 0.0, 0.0, 0.0, 1.0), separator=" ")
assert "TUM" in proposed('world = "enu"\n')
flown("TUM")

# One file twice is one flight.
table("t_s,x_m,y_m,z_m", lambda t: (t, *place(t)))
code, text = run("import", "f.csv", "./f.csv", "-o", "logs", "--force")
assert code == 0 and "1 flight logs" in text and "is given twice; read once" in text, text
PYTHON
