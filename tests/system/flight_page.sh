#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The pages of flights in a real browser, without a network (tests/report/peer/look.cjs): nothing to complain about, nothing wider than the
# window, nothing serious by axe; what the cursor and the files say is what the raw log says, read by other code; the scene turns; the
# charts are there on paper and without scripts.
#   flight_page.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
needs chromium
needs_peers
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
export BACKWASH_DOMAIN=${BACKWASH_DOMAIN:-198}
backwash=$build/services/backwash
[[ $backwash == /* ]] || backwash=$PWD/$backwash
"$source_dir/tests/support/on_the_clock.sh" "$source_dir/services/bench/flight.sh" "$build" "$out" flight builtin:apartment 3.0,4.2,1.2 7.4,3.0,1.2 >/dev/null || { cat "$out/flight.log"; exit 1; }
cd "$out"
"$backwash" fly --map builtin:apartment --report simulated.html --quiet >/dev/null
"$backwash" report --log flight.bwlog --out told.html --quiet >/dev/null # by what was logged alone
# One that failed, one that never took off, in words that would do something if they were not only shown.
PYTHONPATH=$source_dir/tests/system python3 - "$backwash" <<'PYTHON'
import subprocess, sys
from raw_log_maker import *

log = RawLog()
log.free_cube()
log.at = (-0.8, -0.8, -1.2)
log.wait()
log.fly((-0.8, -0.8, -0.8))
log.command(GO_TO, (1, 1, 1), result=1, reason="</script><script>alert(1)</script><img src=x onerror=alert(1)>")
log.fly((-0.8, -0.05, -0.8))
log.fly((-0.05, -0.05, -0.8), error=0.15)
for k in range(20):
    log.tick("hold", ODOMETRY_LOST, log.segments, 40)
log.write("failed'<b>.bwlog", None)
log = RawLog()
log.wait()
log.command(GO_TO, (1, 1, 1), result=1, reason="no map was received")
log.wait()
log.write("ground.bwlog", None)
for name, page in (("failed'<b>", "failed"), ("ground", "ground")):
    ran = subprocess.run([sys.argv[1], "report", "--log", f"{name}.bwlog", "--out", f"{page}.html", "--quiet"], capture_output=True, text=True)
    assert ran.returncode == 1, ran.stderr
PYTHON
look() { node "$source_dir/tests/report/peer/look.cjs" "$modules" "$@" >"${1%.html}.json"; }
# Two times at which a position was judged.
times=$(PYTHONPATH=$source_dir/tests/system python3 -c '
import raw_log
ticks = list(raw_log.ticks("flight.bwlog"))
judged = [tick.t - ticks[0].t for tick in ticks if tick.judged]
print(*(f"{judged[len(judged) * k // 3]:.2f}" for k in (1, 2)))')
look flight.html . 360,900,1600 $times
look simulated.html . 360,1600 5
look failed.html . 360,1600 1
look ground.html . 360,1600
look told.html . 360 5
XDG_DATA_DIRS=/nonexistent "$backwash" fly --map builtin:apartment --report bare.html --quiet >/dev/null
look bare.html . 900

PYTHONPATH=$source_dir/tests/system python3 - "$backwash" <<'PYTHON'
import csv, io, itertools, json, random, re, struct, subprocess, sys, tomllib
import raw_log

pages = {name: json.load(open(f"{name}.json")) for name in ("flight", "simulated", "failed", "ground", "told", "bare")}
for name, page in pages.items():
    assert 20_000 < page["bytes"] <= 5 << 20, (name, page["bytes"])
    for look in page["looks"]:
        assert not look["complaints"] and not look["asked"] and not look["grave"], (name, look)
        assert look["scroll"] <= look["width"] == look["viewport"], (name, look)
    grounds = {look["scheme"]: look["ground"] for look in page["looks"]}
    assert grounds["light"] != grounds["dark"], grounds
    worked = page["worked"]
    assert not worked["complaints"], (name, worked["complaints"])
    shown = worked["shown"]
    assert shown["all"] == shown["print"] == shown["without"] == shown["screen"], (name, shown)
for name in ("flight", "simulated", "failed"):
    worked = pages[name]["worked"]
    assert all(look["plots"] >= 4 for look in pages[name]["looks"]), name
    assert worked["zooms"] and worked["dragged"] and worked["keyboard"][0] != worked["keyboard"][1], worked
    first, turned, dragged = worked["scene"]
    assert min(s["kinds"] for s in worked["scene"]) > 20 and max(s["most"] for s in worked["scene"]) < 0.98, worked["scene"]
    assert len({s["hash"] for s in worked["scene"]}) == 3, "the scene does not turn"
# The plane in the scene: off at first, the flat slice's own numbers at its height, and elsewhere those of `backwash field`: κ √Σ_zz.
model = tomllib.loads(subprocess.run([sys.argv[1], "vehicle", "print", "builtin:quad-5in", "--kind", "model"], capture_output=True, text=True, check=True).stdout)
kappa, mean = model["bound"]["kappa"], model["bound"]["mean"]["vertical"]
table = lambda text: [{k: float(v or "nan") for k, v in row.items()} for row in csv.DictReader(io.StringIO(text))]
def bounds_at(places):
    with open("points.csv", "w") as file:
        file.write("x_m,y_m,z_m\n" + "".join(f"{x},{y},{z}\n" for x, y, z in places))
    asked = json.loads(subprocess.run([sys.argv[1], "field", "--map", "builtin:apartment", "--model", "builtin:quad-5in", "--vehicle", "builtin:quad-5in", "--points", "points.csv",
                                       "--json"], capture_output=True, text=True, check=True).stdout)["points"]
    return [kappa * point["sigma"][5] ** 0.5 + mean for point in asked]


for name in ("flight", "simulated", "told"):
    plane = pages[name]["worked"]["plane"]
    assert plane["off"]["hidden"] == 5 and plane["again"]["hash"] == plane["off"]["hash"], "it is not off where it shall be"
    assert all(kind["hidden"] == 0 and kind["told"] == kind["spoken"] for kind in plane["kinds"]), name
    assert len({kind["hash"] for kind in plane["kinds"]} | {plane["off"]["hash"]}) == 10, f"{name}: the plane does not move"
    assert plane["kinds"][0]["csv"] == pages[name]["worked"]["files"]["field.csv"], f"{name}: the plane at flight height is another slice"
    for kind in plane["kinds"]:
        cells = table(kind["csv"])
        axis = "xyz"[int(kind["kind"])]
        assert len(cells) > 300 and {f"{axis} = {cell[axis + '_m']:.2f} m" for cell in cells} == {kind["told"]}, (name, kind["told"])
    some = random.Random(1).sample([cell for kind in plane["kinds"] for cell in table(kind["csv"])], 60)
    told = bounds_at([(c["x_m"], c["y_m"], c["z_m"]) for c in some])
    for cell, bound in zip(some, told, strict=True):
        assert bound * (1 - 1e-6) <= cell["vertical_bound_mps2"] <= bound * (1 + 6e-4), (name, cell, bound)
    place = min(table(pages[name]["worked"]["files"]["path.csv"]), key=lambda row: abs(row["t_s"] - pages[name]["worked"]["cursors"][0]["t"]))
    here = float(re.search(r"([0-9.]+) m/s²", plane["here"])[1])
    # The body may be at a voxel's edge, and its place between two rows of the path: of the voxels within 3 cm one says that.
    centre = lambda value, of: of + round((value - of) / 0.1) * 0.1
    cell = table(plane["kinds"][0]["csv"])[0]
    about = {tuple(round(centre(place[a] + off, cell[a]), 6) for a, off in zip(("x_m", "y_m", "z_m"), offs)) for offs in itertools.product((-0.03, 0.03), repeat=3)}
    bounds = bounds_at(about)
    assert any(abs(here - bound) < 6e-3 for bound in bounds), (plane["here"], place, bounds)
bare = pages["bare"]["worked"]
assert bare["scene"] == [None] and "error.csv" in bare["files"]
assert "install Debian's libjs-three" in open("bare.html").read()

# What the log holds, by the reader of the system tests.
ticks = [(t, struct.unpack_from("<3Q6I5fI34d2I", body)) for t, kind, body in raw_log.records("flight.bwlog") if kind == raw_log.TICK]
zero = ticks[0][0]
judged = [(t - zero, [tick[15 + a] - tick[31 + a] for a in range(3)], tick[34:37]) for t, tick in ticks if tick[6]]
modes = [(t - zero, raw_log.MODES[tick[3]]) for t, tick in ticks]
worked = pages["flight"]["worked"]


def rows(name):
    return [{k: float(v) if v else None for k, v in row.items()} for row in csv.DictReader(io.StringIO(worked["files"][name]))]


error = rows("error.csv")
at = {round(row["t_s"] * 1e5): row for row in error}
both = [(at[round(t * 1e5)], e, h) for t, e, h in judged if round(t * 1e5) in at]
assert len(both) > 500 and len(error) - 10 <= len(both) >= len(judged) - 10, (len(error), len(judged), len(both))  # the page has what was flown of trajectories
for row, e, h in both:
    for axis, name in enumerate("xyz"):
        assert abs(row[f"error_{name}_m"] - e[axis]) < 2e-6 and abs(row[f"bound_{name}_m"] - h[axis]) < 2e-6, (row, e, h)
timing = rows("ticks.csv")
assert len(timing) == len(ticks)
for row, (t, tick) in zip(timing, ticks):
    assert abs(row["compute_us"] - tick[9]) <= 1e-6 * abs(tick[9]) and abs(row["lateness_us"] - tick[10]) <= 1e-6 * abs(tick[10]), (row, tick)
for row in rows("rates.csv"):
    for column, kind in (("odometry_hz", raw_log.ODOMETRY), ("frames_in_hz", raw_log.FRAME_IN), ("frames_out_hz", raw_log.FRAME_OUT)):
        counted = sum(row["t_s"] <= t - zero < row["t_s"] + 1 for t in raw_log.times("flight.bwlog", kind))
        assert abs(row[column] - counted) <= 1, (row, column, counted)  # times are rounded on the way

assert len(worked["cursors"]) == 2
for cursor in worked["cursors"]:
    t, e, h = min(judged, key=lambda row: abs(row[0] - cursor["t"]))
    values = {column: text.replace("−", "-").lstrip("±") for _, *pairs in cursor["values"] for column, text in pairs}
    for axis, name in enumerate("xyz"):
        assert abs(float(values[f"error_{name}_m"]) - e[axis]) < 6e-5 and abs(float(values[f"bound_{name}_m"]) - h[axis]) < 6e-5, (values, e, h)
    mode = min(modes, key=lambda row: abs(row[0] - cursor["t"]))[1]
    assert cursor["told"].startswith(f"{cursor['t']:.2f} s, {mode}: "), cursor["told"]
page = open("failed.html").read()
assert "<img src=x" not in page and "&lt;img src=x onerror=alert(1)&gt;" in page and "failed'&lt;b&gt;.bwlog" in page
print({name: (page["bytes"], sorted(page["worked"]["files"])) for name, page in pages.items()})
PYTHON
