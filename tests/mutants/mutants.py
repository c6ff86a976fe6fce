#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Mutation test of the safety-relevant code (README.md).

  mutants.py check              the table still fits the sources (seconds; a test of ./check)
  mutants.py build [PROGRAM …]  all mutants as switches of one build, in build/mutants
  mutants.py run [ID|PATH …]    which are killed; exit 1 if the score is below 0.97
  mutants.py draw COUNT         operators of the same sources at random, and their build; then run --drawn
"""
import argparse
import concurrent.futures
import dataclasses
import json
import os
import pathlib
import random
import shutil
import subprocess
import sys
import threading

import drawn
import suite
import table

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
DRAWN = WORK / "drawn.json"
BIN = TREE / "build" / "release" / "tests"
# Those that a mutant must survive to count as living.
PROGRAMS = ["test_config", "test_files", "test_track", "test_bridge", "test_map", "test_field", "test_reach", "test_adapt", "test_daemon",
            "test_plan", "test_sim", "test_promises"]
LEAST_SCORE = 0.97


def prepare(mutants: list[table.Mutant]) -> None:
    """Copies what changed and rewrites. A file is written only if its content differs: little is compiled."""
    files = table.by_file(mutants)
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"], cwd=ROOT, check=True, stdout=subprocess.PIPE)
    wanted = {name: ROOT / name for name in listed.stdout.decode().split("\0") if name and (ROOT / name).is_file()}
    for name, path in wanted.items():
        content = table.rewritten(files[name], path.read_text()).encode() if name in files else path.read_bytes()
        copy = TREE / name
        if copy.exists() and copy.read_bytes() == content:
            continue
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(content)
        shutil.copymode(path, copy)
    for path in TREE.rglob("*"):
        name = path.relative_to(TREE)
        if path.is_file() and name.parts[0] != "build" and str(name) not in wanted:
            path.unlink()
    shared = WORK / "shared"  # the data that some tests read beside the sources
    if (ROOT.parent / "shared").exists() and not shared.exists():
        shared.symlink_to(ROOT.parent / "shared")
    subprocess.run(["cmake", "--preset", "release", "-DBACKWASH_JOIN=OFF"], cwd=TREE, check=True, stdout=subprocess.DEVNULL)


def build(mutants: list[table.Mutant], programs: list[str]) -> None:
    """All mutants as switches of one build."""
    prepare(mutants)
    subprocess.run(["cmake", "--build", "--preset", "release", "--target", *programs, "--", "-k", "0"],
                   cwd=TREE, check=True)


def draw(count: int, seed: int) -> list[table.Mutant]:
    """So many random mutants that compile, of the sources that the table has rows of."""
    rows = drawn.draw(ROOT, {m.file for m in table.load()}, random.Random(seed))
    compiled: dict[str, list[str]] = {}
    while True:
        prepare(rows[:count])
        refused: set[str] = set()
        for file, mutants in table.by_file(rows[:count]).items():
            ids = [m.id for m in mutants]
            if compiled.get(file) == ids:
                continue
            lines = drawn.refused_lines(TREE, file)
            wrong = {m.id for m in mutants if int(m.id.split("-")[-2]) in lines}
            if lines and not wrong:
                sys.exit(f"{file} does not compile, and no mutant is to blame")
            refused |= wrong
            compiled[file] = ids
        if not refused:
            return rows[:count]
        rows = [m for m in rows if m.id not in refused]


def judge(mutant: table.Mutant, test: suite.Test) -> str:
    """How it killed the mutant, or ''. A failure counts if it comes twice: the machine's load may upset a test once."""
    def ended() -> str:
        return suite.run(BIN / test.program, test.name, test.limit, {"BACKWASH_MUTANT": str(mutant.number)})[0]

    how = ended()
    if how == "fails" and not ended():
        return ""
    return "" if not how else f"{test}" if how == "fails" else f"{test} {how}"


def rows_of(result: pathlib.Path) -> dict[str, list[str]]:
    """What an earlier run wrote of each mutant: id, file, verdict, by or why, promise."""
    lines = result.read_text().splitlines()[1:] if result.exists() else []
    return {line.split("\t")[0]: line.split("\t") for line in lines}


def killers(result: pathlib.Path) -> dict[str, list[str]]:
    """The test that killed each mutant of an earlier run: if it is still there, the quickest proof."""
    return {id: [" ".join(row[3].split()[:2])] for id, row in rows_of(result).items() if row[2] == "killed"}


def run(mutants: list[table.Mutant], jobs: int, quick: bool, result: pathlib.Path) -> int:
    """Each mutant against the tests that pass its switch, until one fails: what killed it the last time and those that
    its row names; then, of what lives, all others."""
    earlier = killers(result)
    killed: dict[str, str] = {}
    tried: dict[str, set[tuple[str, str]]] = {m.id: set() for m in mutants}
    tests = suite.Suite(BIN, PROGRAMS, WORK / "survey.json")
    lock = threading.Lock()

    def attempt(m: table.Mutant, specs: list[str], last: bool) -> None:
        passed = 0
        for program, name in [t for spec in specs for t in tests.chosen(spec)]:
            if m.id in killed or (program, name) in tried[m.id]:
                continue
            tried[m.id].add((program, name))
            test = tests.test(program, name)
            if test and test.passes(m.number):
                passed += 1
                if by := judge(m, test):
                    killed[m.id] = by
        if m.id in killed or last:
            print(f"{m.id}: {killed.get(m.id) or f'lives, of {passed} more tests that pass it'}", flush=True)
            with lock:
                write([m], killed, result)

    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        list(pool.map(lambda m: attempt(m, earlier.get(m.id, []) + m.tests, quick), mutants))
        if not quick:
            list(pool.map(lambda m: attempt(m, PROGRAMS, True), [m for m in mutants if m.id not in killed]))
    return report(mutants, killed)


def verdict(m: table.Mutant, killed: dict[str, str]) -> str:
    """Of one mutant that was tried."""
    return "killed" if m.id in killed else "equivalent" if m.equivalent else "real" if m.real else "lived"


def write(mutants: list[table.Mutant], killed: dict[str, str], result: pathlib.Path) -> None:
    """Rows to `result`; those of mutants that were not tried this time stay."""
    rows = rows_of(result)
    for m in mutants:
        rows[m.id] = [m.id, m.file, verdict(m, killed), killed.get(m.id) or m.equivalent or m.real, m.promise]
    result.parent.mkdir(parents=True, exist_ok=True)
    whole = result.with_suffix(".new")  # in one step: another run may be reading it
    whole.write_text("\n".join("\t".join(row) for row in [["id", "file", "verdict", "by or why", "promise"],
                                                          *rows.values()]) + "\n")
    whole.replace(result)


def report(mutants: list[table.Mutant], killed: dict[str, str]) -> int:
    """The score per folder to the terminal, and what lives."""
    print(f"\n| {'sources':20} | mutants | killed | lived | equivalent | score |\n|---|---|---|---|---|---|")
    folders: dict[str, list[str]] = {}
    for m in mutants:
        folders.setdefault(str(pathlib.PurePath(m.file).parent), []).append(verdict(m, killed))
    folders["all"] = [verdict(m, killed) for m in mutants]
    score = 0.0
    for name, verdicts in folders.items():
        equivalent, dead = verdicts.count("equivalent"), verdicts.count("killed")
        judged = len(verdicts) - equivalent
        score = dead / judged if judged else 1.0
        print(f"| {name:20} | {len(verdicts)} | {dead} | {judged - dead} | {equivalent} | {score:.3f} |")
    wrong = [m.id for m in mutants if m.equivalent and m.id in killed]
    for name in wrong:
        print(f"{name}: said to be equivalent, but killed: {killed[name]}")
    for m in mutants:
        if verdict(m, killed) in ("lived", "real"):
            print(f"{m.id} lives: {m.promise} {m.real}")
    return 1 if score < LEAST_SCORE or wrong else 0


def main() -> int:
    """Command line."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("what", choices=["check", "build", "run", "draw"])
    arguments.add_argument("names", nargs="*", help="only these mutants, or those of these folders; programs to build")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments.add_argument("--quick", action="store_true", help="only the tests that the rows name")
    arguments.add_argument("--drawn", action="store_true", help="those that were drawn, not the table")
    arguments.add_argument("--seed", type=int, default=1, help="of draw")
    given = arguments.parse_intermixed_args()
    if given.what == "draw":
        mutants = draw(int(given.names[0]), given.seed)
        DRAWN.write_text(json.dumps([dataclasses.asdict(m) for m in mutants], indent=1))
        build(mutants, PROGRAMS)
        return 0
    mutants = [table.Mutant(**m) for m in json.loads(DRAWN.read_text())] if given.drawn else table.load()
    wrong = [] if given.drawn else table.check(mutants, ROOT)
    if given.what == "check" or wrong:
        print("\n".join(wrong) or f"{len(mutants)} mutants, each where the table says")
        return 1 if wrong else 0
    if given.what == "build":
        build(mutants, given.names or PROGRAMS)
        return 0
    wanted = [m for m in mutants if not given.names or
              any(m.id == name or m.file.startswith(name) for name in given.names)]
    return run(wanted, given.jobs, given.quick, WORK / ("drawn.tsv" if given.drawn else "result.tsv"))


if __name__ == "__main__":
    sys.exit(main())
