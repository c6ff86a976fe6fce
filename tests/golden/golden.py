#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the programs say on fixed inputs, before a change and after it, byte for byte: for changes that shall change nothing.

golden.py record  BUILD FOLDER [--raw LOG --truth CSV]    makes the inputs, runs every case and keeps what it said
golden.py compare BUILD FOLDER                            runs every case again; exit 1 and the first lines that differ
    --only TEXT     the cases whose names begin so, and no others
    --within SHARE  numbers may differ by this share of themselves; the largest difference is said (a numerical method changed)

Inputs: worlds of tests/study_worlds, simulated flights, maps (builtin and geb079), recordings of
../shared/data where they are, and a raw log of the daemon: the one given, or of a flight in lockstep (test_daemon). They
are made once and stay in FOLDER, so a changed generator is no difference. The flight in lockstep is flown again by every
build, and its raw log compared record by record. Times that a clock measured and the version are taken out. What remains
depends on the machine's libm and compiler, so that it is kept in FOLDER and not in the tree. Of a TOML file the values
count, not the layout.
"""
import argparse
import concurrent.futures
import difflib
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
DATA = ROOT.parent / "shared/data"
GEB079 = ROOT / "tests/data/maps/geb079.bt"
QUAD = "builtin:quad-5in"
MODEL = "builtin:quad-5in"
NUMBER = re.compile(r"-?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?")
CLOCK = re.compile(r'\(\d+ ms(?: total)?\)|"(?:\w+_ms|planning_ms|version)": ?(?:\{[^}]*\}|"[^"]*"|[\d.eE+-]+|null),?')
# Hidden causes of the worlds; several causes with a plus; what comes after / is the size.
WORLDS = ["none", "unknown", "ground_thrust", "ceiling", "wall_attraction", "recirculation", "forward_speed", "battery_sag",
          "thrust_slope", "payload", "trim", "draft", "rotor_drag", "actuator_lag", "command_latency", "imu_drift", "vibration",
          "map_offset", "heavy_tails", "propeller_damage", "rotor_sensor_fault", "wall_attraction+battery_sag",
          "ceiling+trim", "draft/0.5", "rotor_drag/2", "none/1", "payload+vibration", "map_offset+ground_thrust",
          "forward_speed/0.5", "heavy_tails/2"]
PAGES = {"wall_attraction", "propeller_damage", "unknown"}  # worlds of which page, model and the smallest effects are kept


RAW_LOG, TICK, CONSTANTS = b"backwash raw log", 8, 10
LOCKSTEP = "Replay.OfAFlightIsBitForBitEqualEachTime"  # leaves its raw log where the variable below says


def run(command: list, cwd: pathlib.Path) -> subprocess.CompletedProcess:
    environment = os.environ | {"BACKWASH_KEEP_RAW_LOG": "flight.bwlog"}
    return subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, timeout=600, check=False, env=environment)


def made(command: list, cwd: pathlib.Path) -> None:
    done = run(command, cwd)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.decode()}")


def lockstep(build: pathlib.Path) -> list:
    return [build / "tests/test_daemon", f"--gtest_filter={LOCKSTEP}"]


def grid(low: str, high: str) -> str:
    return (f"start = [0, 0, 1.0]\nstrength_sd = 0.35\n[grid]\nlow = {low}\nhigh = {high}\ncount = [1, 3, 4]\n"
            "jitter = 0.03\ndwell = 5.0\n")


def make_inputs(build: pathlib.Path, folder: pathlib.Path, raw: str, truth: str) -> None:
    """Everything that the cases read, as files below folder/inputs."""
    inputs = folder / "inputs"
    inputs.mkdir(parents=True)
    backwash, worlds = build / "services/backwash", build / "tests/study_worlds/study_worlds"
    for n, name in enumerate(WORLDS):
        causes, _, size = name.partition("/")
        command = [worlds, "--out", inputs / f"world{n}", "--seed", 100 + n, "--size", size or 1]
        for cause in causes.split("+"):
            command += ["--cause", cause] if cause != "none" else []
        made(command, inputs)
    (inputs / "two.toml").write_text(grid("[0, -0.7, 0.35]", "[0, 0.7, 2.2]"))
    (inputs / "four.toml").write_text(grid("[0, -1.7, 0.35]", "[0, 1.7, 2.2]"))
    for name, room in (("two", "2m"), ("four", "4m")):
        for seed in (1, 2):
            made([backwash, "simulate", "--map", f"builtin:parallel-walls-{room}", "--vehicle", QUAD, "--flight", f"{name}.toml",
                  "--seed", seed, "--out", f"{name}{seed}.csv"], inputs)
    times = [0.02 * n for n in range(150)]
    rows = [(t, 3.4 - 0.4 * math.cos(t), 0.4 * math.sin(t), 0.4 * math.cos(t)) for t in times]
    header = "t_s,cmd_x_m,cmd_y_m,cmd_z_m,cmd_vx_mps,cmd_ax_mps2"
    lines = [f"{t:.2f},{x:.6f},4.2,1.2,{v:.6f},{a:.6f}" for t, x, v, a in rows]
    (inputs / "places.csv").write_text("\n".join([header, *lines]) + "\n")
    header += ",sigma_xx,sigma_xy,sigma_xz,sigma_yy,sigma_yz,sigma_zz"
    (inputs / "variances.csv").write_text("\n".join([header, *(line + ",0.02,0.001,0,0.03,0,0.04" for line in lines)]) + "\n")
    for kind in ("airgarage", "crazypad"):
        if files := sorted((DATA / kind).glob("*.csv"))[:24]:
            labels = ROOT / "tests/data" / kind / "labels.csv"
            beside = ["--labels", labels] if labels.is_file() else []
            made([backwash, "import", kind, *files, *beside, "-o", kind], inputs)
    if not raw:
        made(lockstep(build), inputs)
    for name, path in (("flight.bwlog", raw), ("truth.csv", truth)):
        if path:
            shutil.copy(path, inputs / name)
    if GEB079.is_file():
        shutil.copy(GEB079, inputs / "geb079.bt")


def study_cases(inputs: pathlib.Path) -> dict:
    cases = {}
    for n, name in enumerate(WORLDS):
        world = inputs / f"world{n}"
        command = ["study", "--vehicle", world / "vehicle.toml", "--model", MODEL, "--seed", 7, "--json",
                   "--log", *sorted(world.glob("*.csv"))]
        if (world / "map.bt").is_file():
            command += ["--map", world / "map.bt"]
        command += ["--report", "page.html", "--out", "model.toml"] if name in PAGES else ["--quick"]
        cases[f"study {n} {name.replace('/', ' ')}"] = command
    if pads := sorted((inputs / "crazypad").glob("*.csv")):
        cases["study crazypad"] = ["study", "--vehicle", QUAD, "--quick", "--json", "--report", "page.html", "--reference",
                                   *pads[:8], "--log", *pads[8:20]]
    if garage := sorted((inputs / "airgarage").glob("*.csv")):
        cases["study airgarage"] = ["study", "--vehicle", QUAD, "--quick", "--json", "--log", *garage]
        cases["calibrate airgarage"] = ["calibrate", "--map", "builtin:parallel-walls-4m", "--log", *garage, "--judge", "--json"]
    for log in sorted((DATA / "ulog").glob("*.ulg")):
        cases[f"study {log.stem}"] = ["study", "--vehicle", QUAD, "--quick", "--json", "--log", log]
    return cases


def cases_of(folder: pathlib.Path) -> dict:
    """Name → arguments of backwash; files it writes go to the case's own folder."""
    inputs = folder / "inputs"
    maps = {"apartment": ("builtin:apartment", "3.0,4.2,1.2", "7.4,3.0,1.2")}
    if (inputs / "geb079.bt").is_file():
        maps["geb079"] = (inputs / "geb079.bt", "13.08,0.68,1.16", "26.52,-0.52,0.76")
    cases = {}
    for name, (path, start, goal) in maps.items():
        common = ["--map", path, "--model", MODEL, "--vehicle", QUAD]
        cases[f"plan {name}"] = ["plan", *common, "--start", start, "--goal", goal, "--json"]
        cases[f"field {name}"] = ["field", "--map", path, "--model", MODEL, "--slice", "z=1.2", "--json", "--out", "slice.svg"]
        cases[f"feasibility {name}"] = ["feasibility", *common, "--json"]
        cases[f"fly {name}"] = ["fly", *common, "--start", start, "--goal", goal, "--seed", 3, "--json", "--report", "page.html"]
    cases["vehicle tune"] = ["vehicle", "tune", "--map", "builtin:apartment", "--model", MODEL, "--vehicle", QUAD,
                             "--start", "3.0,4.2,1.2", "--goal", "7.4,3.0,1.2", "--json"]
    two, four = sorted(inputs.glob("two?.csv")), sorted(inputs.glob("four?.csv"))
    both = ["--map", "builtin:parallel-walls-2m", "--log", *two, "--map", "builtin:parallel-walls-4m", "--log", *four]
    cases["calibrate"] = ["calibrate", *both, "--vehicle", QUAD, "--bootstraps", 20, "--out", "model.toml", "--report", "page.html",
                          "--json"]
    cases["calibrate judge"] = ["calibrate", *both, "--judge", "--json"]
    cases["compare"] = ["compare", "--scenes", "builtin:narrow-gap", "--flights", 2, "--seed", 5, "--json", "--report", "page.html",
                        "--out", "pairs.csv"]
    for track, method in (("variances", "tight"), ("variances", "paper"), ("places", "tight"), ("places", "chance")):
        cases[f"reach {track} {method}"] = ["reach", "--vehicle", QUAD, "--model", MODEL, "--track", inputs / f"{track}.csv",
                                            "--method", method, "--json", *(["--map", "builtin:apartment"] if track == "places"
                                                                            else []),
                                            *(["--probability", "1e-3"] if method == "chance" else [])]
    raw, truth = inputs / "flight.bwlog", inputs / "truth.csv"
    cases["replay"] = ["replay", "--log", raw, "--json"]
    if truth.is_file():
        cases["report"] = ["report", "--log", raw, "--truth", truth, "--json", "--out", "page.html"]
    return cases | study_cases(inputs)


def records(log: bytes):
    """A raw log's records as lines, without what the machine measured: the microseconds and page faults of a tick, and the
    time at which the loop was made (core/log/raw/raw_log.hpp)."""
    at = len(RAW_LOG) + log[len(RAW_LOG):].index(b"\n") + 1
    while at < len(log):
        t_ns, kind, size = struct.unpack_from("<qII", log, at)
        body = bytearray(log[at + 16:at + 16 + size])
        if kind == TICK:
            for measured in (48, 52, 56, 68):
                body[measured:measured + 4] = bytes(4)
        yield f"{kind} {0 if kind == CONSTANTS else t_ns} {body.hex()}"
        at += 16 + size


def normal(text: bytes, folder: pathlib.Path, version: str) -> bytes:
    if text.startswith(b"\x89PNG"):
        return text
    if text.startswith(RAW_LOG):
        return "\n".join(records(text)).encode()
    said = text.decode(errors="surrogateescape").replace(version, "VERSION").replace(str(folder), "FOLDER")
    return CLOCK.sub("", said).encode(errors="surrogateescape")


def kept(out: pathlib.Path, only: str) -> dict:
    """Case/file → what it said."""
    return {str(f.relative_to(out)): f.read_bytes() for case in sorted(out.glob(only + "*")) for f in sorted(case.iterdir())}


def say(build: pathlib.Path, folder: pathlib.Path, out: pathlib.Path, only: str) -> dict:
    """Runs the cases, which write below `out`."""
    backwash = build / "services/backwash"
    version = run([backwash, "--version"], folder).stdout.decode().split()[-1]
    for case in out.glob(only + "*"):
        shutil.rmtree(case)

    def one(item):
        name, arguments = item
        place = out / name
        place.mkdir(parents=True)
        done = run(arguments if name == "lockstep" else [backwash, *arguments], place)
        (place / "stdout").write_bytes(done.stdout)
        (place / "stderr").write_bytes(done.stderr + b"exit %d\n" % done.returncode)
        for file in place.iterdir():
            file.write_bytes(normal(file.read_bytes(), folder, version))

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        cases = cases_of(folder) | {"lockstep": lockstep(build)}
        list(pool.map(one, [case for case in cases.items() if case[0].startswith(only)]))
    return kept(out, only)


def lines_of(name: str, said: bytes) -> list[str]:
    """What counts of a file: of TOML the values, of HTML all but milliseconds, of CSV the columns that are no milliseconds."""
    text = said.decode(errors="replace")
    if name.endswith(".toml"):
        try:
            return json.dumps(tomllib.loads(text), sort_keys=True, indent=0).splitlines()
        except tomllib.TOMLDecodeError as error:
            return [f"no TOML: {error}", *text.splitlines()]
    if name.endswith(".html"):
        text = re.sub(r"[\d.]+\s*ms\b|<td>\d+ / \d+</td>", "", text)
    lines = text.splitlines()
    if name.endswith(".csv") and lines:
        counted = [n for n, column in enumerate(lines[0].split(",")) if not column.endswith("_ms")]
        lines = [",".join(line.split(",")[n] for n in counted) for line in lines]
    return lines


def largest_difference(a: list[str], b: list[str]) -> float:
    """Of numbers at the same place, as a share of the larger; infinite where anything else differs."""
    a, b = "\n".join(a), "\n".join(b)
    if NUMBER.sub("#", a) != NUMBER.sub("#", b):
        return math.inf
    pairs = zip(map(float, NUMBER.findall(a)), map(float, NUMBER.findall(b)))
    return max((abs(x - y) / max(abs(x), abs(y)) for x, y in pairs if x != y), default=0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["record", "compare"])
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    for option in ("--raw", "--truth", "--only"):
        parser.add_argument(option, default="")
    parser.add_argument("--within", type=float, default=0)
    options = parser.parse_args()
    build, folder = options.build.resolve(), options.folder.resolve()
    golden = folder / "golden"
    if options.what == "record":
        if not (folder / "inputs").is_dir():
            make_inputs(build, folder, options.raw, options.truth)
        print(f"{len(say(build, folder, golden, options.only))} files are kept in {golden}")
        return 0
    before, after = kept(golden, options.only), say(build, folder, folder / "now", options.only)
    differing, largest = [], 0.0
    for name in sorted(before.keys() | after.keys()):
        a, b = (lines_of(name, side.get(name, b"")) for side in (before, after))
        if a == b and name in before and name in after:
            continue
        largest = max(largest, difference := largest_difference(a, b))
        if difference <= options.within:
            continue
        differing.append(name)
        changes = [line[:160] for line in difflib.unified_diff(a, b, lineterm="", n=0)]
        print(name, *[line for line in changes if not line.startswith(("---", "+++", "@@"))][:4], sep="\n  ")
    print(f"{len(after)} files, {len(differing)} differ" + (f"; numbers by at most {largest:.2g}" if options.within else ""))
    return 1 if differing or not before else 0


if __name__ == "__main__":
    sys.exit(main())
