# SPDX-License-Identifier: BSD-3-Clause
"""The module's answers are the tool's, over memory that is the program's own, and live as long as somebody looks at them.

module.py BACKWASH      in an empty folder, with the module on PYTHONPATH
"""
import gc
import json
import lzma
import pathlib
import subprocess
import sys
import threading
import time


import backwash
import numpy as np

TOOL, SOURCE = sys.argv[1], pathlib.Path(__file__).resolve().parents[2]
QUAD = "builtin:quad-5in"


def tool(*line, code=0):
    ran = subprocess.run([TOOL, *line, "--json", "--quiet"], capture_output=True, text=True)
    assert ran.returncode == code, (line, ran.stderr)
    return json.loads(ran.stdout)


def refusal(*line):
    ran = subprocess.run([TOOL, *line], capture_output=True, text=True)
    assert ran.returncode >= 64, line
    return ran.stderr.strip().split(": ", 1)[1]


def raised(kind, call, *arguments, **named):
    try:
        call(*arguments, **named)
    except kind as error:
        return str(error)
    raise AssertionError(f"no {kind.__name__}")


def bytes_of_process():
    return int(next(line for line in open("/proc/self/status") if line.startswith("VmRSS")).split()[1]) * 1024


# The field: entry by entry what the tool says of its stored field, and near the exact one.
for scene in ("builtin:parallel-walls-1m", str(SOURCE / "tests/data/maps/huayu_room_0.05.bt")):
    room, model = backwash.Map(scene), backwash.Model(QUAD)
    sigma = backwash.field(room, model, backwash.Vehicle("builtin:quad-7in"))
    assert sigma.shape == (*room.cells.shape, 6) and sigma.dtype == np.float32 and sigma.flags.c_contiguous
    assert (np.isfinite(sigma).all(axis=-1) == (room.cells == 1)).all() and (np.isnan(sigma).all(axis=-1) == (room.cells != 1)).all()
    free = np.argwhere(room.cells == 1)[:: max(1, (room.cells == 1).sum() // 300)]
    points = room.origin + room.resolution * (free[:, ::-1] + 0.5)
    np.savetxt("points.csv", points, delimiter=",", header="x_m,y_m,z_m", comments="", fmt="%.17g")
    asked = ["field", "--map", scene, "--model", QUAD, "--vehicle", "builtin:quad-7in", "--points", "points.csv"]
    stored = np.array([p["sigma"] for p in tool(*asked, "--interpolated")["points"]])
    exact = np.array([p["sigma"] for p in tool(*asked)["points"]])
    ours = sigma[tuple(free.T)]
    assert len(free) > 100 and np.allclose(ours, stored, rtol=2e-7, atol=1e-12), np.abs(ours - stored).max()
    assert np.abs(ours - exact).max() < 1e-4 * exact.max(), np.abs(ours - exact).max()
    volume = np.load("x.npz") if tool("field", "--map", scene, "--model", QUAD, "--vehicle", "builtin:quad-7in", "--volume", "x.npz", "--force") else None
    assert np.array_equal(volume["sigma"], sigma, equal_nan=True) and np.array_equal(volume["cells"], room.cells)
    assert np.array_equal(volume["origin"], room.origin) and volume["resolution"] == room.resolution and volume["resolution"].shape == ()
before = pathlib.Path("x.npz").read_bytes()
again = ["field", "--map", scene, "--model", QUAD, "--volume", "x.npz"]
assert "exists already" in refusal(*again) and pathlib.Path("x.npz").read_bytes() == before
subprocess.run([sys.executable, "-m", "zipfile", "-t", "x.npz"], check=True, stdout=subprocess.DEVNULL)

# So is the factor of an extended model, by place and everywhere.
text = (SOURCE / "core/config/files/quad-5in.model.toml").read_text()
pathlib.Path("rough.toml").write_text(text + """[[extension.term]]
name = "gusts"
effect = [{ kind = "ln_variance", value = [0.7], error = [0.1] }, { kind = "ln_variance_under_surface", value = [0.9], error = [0.1], scale = 0.3 }]
""")
rough, room = backwash.Model("rough.toml"), backwash.Map("builtin:apartment")
free = np.argwhere(room.cells == 1)[::400]
points = room.origin + room.resolution * (free[:, ::-1] + 0.5)
np.savetxt("points.csv", points, delimiter=",", header="x_m,y_m,z_m", comments="", fmt="%.17g")
plain, rougher = (backwash.field(room, m)[tuple(free.T)] for m in (model, rough))
stored = np.array([p["sigma"] for p in tool("field", "--map", "builtin:apartment", "--model", "rough.toml", "--points", "points.csv", "--interpolated")["points"]])
factor = np.log(rougher[:, 0] / plain[:, 0])
assert np.allclose(rougher, stored, rtol=1e-6, atol=1e-12) and factor.min() > 0.69 and np.ptp(factor) > 0.1

# No copy: one field is in memory, read and written in place; and it outlives all that it came from.
room = backwash.Map("builtin:apartment")
base = sigma = None
gc.collect()
at_first = bytes_of_process()
sigma = backwash.field(room, backwash.Model(QUAD))
assert not sigma.flags.owndata and type(sigma.base).__name__ == "PyCapsule" and sigma.flags.writeable
assert bytes_of_process() - at_first < 1.6 * sigma.nbytes + 8e6, (bytes_of_process() - at_first, sigma.nbytes)
part = sigma[3:, ..., 5]
assert np.shares_memory(part, sigma)
kept = part.copy()
cells, again = room.cells, room.cells
assert np.shares_memory(cells, again) and not cells.flags.owndata and not cells.flags.writeable and cells.base is room

sums = int(cells.sum())
del room, sigma, again
gc.collect()
filler = [np.full(part.size, 7.0) for _ in range(20)]
assert np.array_equal(part, kept, equal_nan=True) and int(cells.sum()) == sums
del filler
for _ in range(30):
    backwash.field(backwash.Map("builtin:narrow-gap"), backwash.Model(QUAD))
held = bytes_of_process()
for _ in range(30):
    backwash.field(backwash.Map("builtin:narrow-gap"), backwash.Model(QUAD))
assert bytes_of_process() - held < 3e6, "fields are not given back"

# A map from cells is the same map.
gap = backwash.Map("builtin:narrow-gap")
made = backwash.Map(gap.cells.copy(), gap.origin, gap.resolution)
assert np.array_equal(backwash.field(made, model), backwash.field(gap, model), equal_nan=True) and not np.shares_memory(made.cells, gap.cells)

# Plans, tubes and sets are the tool's.
quad = backwash.Vehicle(QUAD)
ends = ("--start", "1,0,1", "--goal", "5,0,1")
asked = ["plan", "--map", "builtin:narrow-gap", "--model", QUAD, "--vehicle", QUAD, *ends]


def untimed(plan):
    return {**plan, "metrics": {k: v for k, v in plan["metrics"].items() if not k.endswith("_ms")}}


for options, named, limits in (((), {}, {}), (("--method", "paper", "--vmax", "0.8"), {"method": "paper"}, {"v_max": 0.8}), (("--margin", "0.1"), {"margin": 0.1}, {}),
                               (("--risk", "0.001"), {"risk": 1e-3}, {})):
    world = backwash.World(gap, model, quad, **named)
    ours = world.plan((1, 0, 1), (5, 0, 1), **limits)
    assert ours["status"] == "ok" and untimed(ours) == untimed(tool(*asked, *options)), options
world = backwash.World(gap, model, quad)
blocked, tight = world.plan((1, 0, 1), (3, 1.5, 1)), backwash.World(gap, model, quad, margin=0.4).plan((1, 0, 1), (5, 0, 1))
for plan, status, line in ((blocked, "goal_blocked", [*asked[:-1], "3,1.5,1"]), (tight, "no_path", [*asked, "--margin", "0.4"])):
    assert plan["status"] == status and untimed(plan) == untimed(tool(*line, code=69)), plan["message"]
ours = world.plan((1, 0, 1), (5, 0, 1))
track = np.array([[*c["p"], *c["v"], *c["a"]] for c in ours["trajectory"]])
names = ",".join(f"cmd_{d}{axis}_{unit}" for d, unit in (("", "m"), ("v", "mps"), ("a", "mps2")) for axis in "xyz")
np.savetxt("track.csv", np.column_stack([0.02 * np.arange(len(track)), track]), delimiter=",", header="t_s," + names, comments="", fmt="%.17g")
assert world.tube(track) == tool("reach", "--vehicle", QUAD, "--track", "track.csv", "--map", "builtin:narrow-gap", "--model", QUAD)["steps"]
sets = world.sets(np.array([[1, 0, 1], [3, 0, 1], [3, 1.5, 1]]))
assert sets["safe"].tolist() == [True, True, False] and sets["half_widths"].shape == (3, 5) and sets["clearance"][0] > sets["clearance"][1] > 0
# A set at rest holds every tube that has long been there.
rest = world.tube(np.tile([3.0, 0, 1, 0, 0, 0, 0, 0, 0], (500, 1)))[-1]["half_widths"]
assert all(rest[n] <= w * 1.0001 and rest[n] > 0.8 * w for n, w in zip(("x", "y", "z", "xy_plus", "xy_minus"), sets["half_widths"][1]))
index = np.floor((np.array([[1, 0, 1], [3, 0, 1], [3, 1.5, 1]]) - gap.origin) / gap.resolution).astype(int)
safe = world.safe
assert safe.dtype == bool and not safe.flags.owndata and safe.sum() > 100 and safe[tuple(index[0][::-1])] and not safe[tuple(index[2][::-1])]
many = int(safe.sum())
del world
gc.collect()
assert int(safe.sum()) == many

# Logs, and the answers of other verbs.
flight = SOURCE / "tests/data/ardupilot/door_truth.csv"
columns = backwash.read_log(flight)
lines = [line for line in flight.read_text().splitlines() if not line.startswith("#")]
table = np.loadtxt(lines[1:], delimiter=",")
for k, name in enumerate(lines[0].split(",")):
    assert np.array_equal(columns[name], table[:, k]) and not columns[name].flags.owndata, name
assert list(columns) == ["t_s", *sorted(n for n in columns if n != "t_s")]
pathlib.Path("left.bwlog").write_bytes(lzma.open(SOURCE / "tests/data/flights/left_its_set.bwlog.xz").read())
assert backwash.report("left.bwlog") == tool("report", "left.bwlog", code=1)
door = str(SOURCE / "tests/data/ardupilot/door.bin")
assert backwash.report(log=door) == tool("report", "--log", door)
pathlib.Path("hover.toml").write_text('start = [0, 0, 1.0]\n[grid]\nlow = [0, -0.4, 0.4]\nhigh = [0, 0.4, 1.6]\ncount = [1, 3, 3]\njitter = 0.03\ndwell = 5.0\n')
logs = [f"flight-{k}.csv" for k in range(10)]
walls = "builtin:parallel-walls-2m"
for k, log in enumerate(logs):
    backwash.run("simulate", map=walls, vehicle=QUAD, model=QUAD, flight="hover.toml", seed=k + 1, out=log)
ours = backwash.study(*logs, map=walls, vehicle=QUAD, quick=True, out="ours.toml")
line = ["study", *logs, "--map", walls, "--vehicle", QUAD, "--quick", "--out", "theirs.toml"]
theirs = tool(*line)
assert ours.pop("extended_model") == "ours.toml" and theirs.pop("extended_model") == "theirs.toml" and ours == theirs and ours["flights"] == 10
assert pathlib.Path("ours.toml").read_text() == pathlib.Path("theirs.toml").read_text()
at = backwash.run("field", map=walls, model=QUAD, at=(0, 0.5, 1), vehicle=None, interpolated=False)
assert at == tool("field", "--map", walls, "--model", QUAD, "--at", "0,0.5,1")
assert backwash.run("map", "info", walls) == tool("map", "info", walls)

# What is wrong is said in the tool's words.
line = ["--map", walls, "--model", QUAD]
assert raised(FileNotFoundError, backwash.Map, "nowhere.bt") == refusal("field", "--map", "nowhere.bt", "--model", QUAD, "--at", "0,0,1")
assert raised(FileNotFoundError, backwash.Map, "builtin:nowhere") == refusal("field", "--map", "builtin:nowhere", "--model", QUAD, "--at", "0,0,1")
pathlib.Path("bad.toml").write_text(text.replace("theta_max", "theta_most"))
assert raised(ValueError, backwash.Model, "bad.toml") == refusal("field", "--map", walls, "--model", "bad.toml", "--at", "0,0,1")
pathlib.Path("bad.csv").write_text("t_s,x_m\n0,1\n0.1,one\n")
assert "bad.csv:3" in raised(ValueError, backwash.read_log, "bad.csv")
assert raised(ValueError, backwash.run, "field", map=walls, model=QUAD) == refusal("field", *line)
assert raised(ValueError, backwash.run, "field", map=walls, model=QUAD, volumen="x") == refusal("field", *line, "--volumen", "x")
assert "no verb 'fild', did you mean 'field'?" in raised(ValueError, backwash.run, "fild")
assert raised(FileExistsError, backwash.run, "field", map=walls, model=QUAD, volume="x.npz") == refusal("field", *line, "--volume", "x.npz")
assert "--help" in raised(ValueError, backwash.run, "field", help=True)
world = backwash.World(gap, model, quad)
for wrong in ((world.sets, np.zeros((2, 2))), (world.sets, np.full((1, 3), np.nan)), (world.sets, np.zeros((0, 3))), (world.tube, np.zeros((4, 3))), (world.plan, (1, 0, 1), (5, 0, np.inf)),
              (backwash.Map, np.full((2, 2, 2), 3, np.uint8), (0, 0, 0), 0.1), (backwash.Map, np.zeros((2, 2), np.uint8), (0, 0, 0), 0.1), (backwash.Map, np.zeros((2, 2, 2), np.uint8), (0, 0, 0), -1)):
    raised(ValueError, *wrong)
for other in (bool, float, np.int64):  # what is cast turns walls into air
    raised(TypeError, backwash.Map, np.zeros((2, 2, 2), other), (0, 0, 0), 0.1)
raised(ValueError, backwash.World, gap, model, quad, margin=0.3, risk=0.01)
raised(ValueError, world.plan, (1, 0, 1), (5, 0, 1), v_max=0)
raised(ValueError, backwash.World, gap, model, quad, method="loose")
raised(TypeError, backwash.field, "builtin:narrow-gap", model)
pathlib.Path("slow.toml").write_text((SOURCE / "core/config/files/quad-5in.vehicle.toml").read_text().replace("attitude_lag = 0.05", "attitude_lag = 0.5", 1))
assert raised(ValueError, backwash.Vehicle, "slow.toml") == refusal("plan", *line, "--vehicle", "slow.toml", *ends)

# Other threads run while one computes, and calls of several threads give what one gives.
ticks, end = [], threading.Event()
watch = threading.Thread(target=lambda: [ticks.append(time.monotonic()) or time.sleep(0.002) for _ in iter(end.is_set, True)])
watch.start()
begun, found = time.monotonic(), []
apartment = backwash.Map("builtin:apartment")
workers = [threading.Thread(target=lambda: found.append(backwash.field(apartment, backwash.Model(QUAD)))) for _ in range(4)]
[w.start() for w in workers]
[w.join() for w in workers]
took = time.monotonic() - begun
end.set()
watch.join()
pause = max(b - a for a, b in zip(ticks, ticks[1:]))
assert len(ticks) > 20 and pause < 0.5 * took, (pause, took)
assert all(np.array_equal(f, found[0], equal_nan=True) for f in found) and len(found) == 4
assert all(backwash.__dict__[name].__doc__ for name in ("field", "World", "Map", "read_log", "run", "study", "report")) and backwash.__version__ in subprocess.run(
    [TOOL, "--version"], capture_output=True, text=True).stdout
print("the module answers as the tool")
