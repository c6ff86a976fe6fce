#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Mutation test of the safety-relevant code (README.md).

  mutants.py run [ID|PATH …]    builds all mutants as switches of one build and tries each; exit 1 if the score is below 0.97
  mutants.py check              the table still fits the sources (seconds; a test of ./check)
  mutants.py draw COUNT         the same as run, of operators of the same sources that are drawn at random
"""
import argparse
import concurrent.futures
import os
import pathlib
import random
import shutil
import subprocess
import sys
import threading
import time

import drawn
import suite
import table

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
BIN = TREE / "build" / "release" / "tests"
# The test programs that the table names: what lives was tried against all of them.
PROGRAMS = sorted({spec.split()[0] for m in table.load() for spec in m.tests})
LEAST_SCORE = 0.97


def prepare(mutants: list[table.Mutant], joined: bool) -> None:
    """Copies what changed and rewrites. A file is written only if its content differs: little is compiled. Joined: several files are
    compiled as one, which halves the time; what was drawn is compiled file by file until all of it compiles."""
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
    subprocess.run(["cmake", "--preset", "release", f"-DBACKWASH_JOIN={'ON' if joined else 'OFF'}"], cwd=TREE, check=True, stdout=subprocess.DEVNULL)


def build(mutants: list[table.Mutant], jobs: int, joined: bool) -> None:
    """All mutants as switches of one build."""
    begun = time.monotonic()
    prepare(mutants, joined)
    subprocess.run(["cmake", "--build", "--preset", "release", "--target", *PROGRAMS, "--", "-k", "0", f"-j{jobs}"], cwd=TREE, check=True)
    print(f"built in {(time.monotonic() - begun) / 60:.0f} min", flush=True)


def draw(count: int, seed: int) -> list[table.Mutant]:
    """So many random mutants that compile, of the sources that the table has rows of."""
    rows = drawn.draw(ROOT, {m.file for m in table.load()}, random.Random(seed))
    compiled: dict[str, list[str]] = {}
    while True:
        prepare(rows[:count], joined=False)
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
    """What an earlier run wrote of each mutant: id, file, verdict, by, promise."""
    lines = result.read_text().splitlines()[1:] if result.exists() else []
    return {line.split("\t")[0]: line.split("\t") for line in lines}


def killers(result: pathlib.Path) -> dict[str, list[str]]:
    """The test that killed each mutant of an earlier run: if it is still there, the quickest proof."""
    return {id: [" ".join(row[3].split()[:2])] for id, row in rows_of(result).items() if row[2] == "killed"}


def run(mutants: list[table.Mutant], jobs: int, result: pathlib.Path) -> int:
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

    begun = time.monotonic()
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        list(pool.map(lambda m: attempt(m, earlier.get(m.id, []) + m.tests, False), mutants))
        list(pool.map(lambda m: attempt(m, PROGRAMS, True), [m for m in mutants if m.id not in killed]))
    print(f"tried in {(time.monotonic() - begun) / 60:.0f} min")
    return report(mutants, killed)


def write(mutants: list[table.Mutant], killed: dict[str, str], result: pathlib.Path) -> None:
    """Rows to `result`; those of mutants that were not tried this time stay."""
    rows = rows_of(result)
    for m in mutants:
        rows[m.id] = [m.id, m.file, "killed" if m.id in killed else "lived", killed.get(m.id, ""), m.promise]
    result.parent.mkdir(parents=True, exist_ok=True)
    whole = result.with_suffix(".new")  # in one step: another run may be reading it
    whole.write_text("\n".join("\t".join(row) for row in [["id", "file", "verdict", "by", "promise"],
                                                          *rows.values()]) + "\n")
    whole.replace(result)


def report(mutants: list[table.Mutant], killed: dict[str, str]) -> int:
    """The score per folder to the terminal, and what lives."""
    folders: dict[str, list[bool]] = {}
    for m in mutants:
        for name in (str(pathlib.PurePath(m.file).parent), "all"):
            folders.setdefault(name, []).append(m.id in killed)
    print(f"\n| {'sources':20} | mutants | killed | score |\n|---|---|---|---|")
    for name, dead in sorted(folders.items(), key=lambda f: f[0] == "all"):
        print(f"| {name:20} | {len(dead)} | {sum(dead)} | {sum(dead) / len(dead):.3f} |")
    for m in mutants:
        if m.id not in killed:
            print(f"{m.id} lives: {m.promise}")
    return 1 if len(killed) < LEAST_SCORE * len(mutants) else 0


def main() -> int:
    """Command line."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("what", choices=["run", "check", "draw"])
    arguments.add_argument("names", nargs="*", help="only these mutants, or those of these folders; how many to draw")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments.add_argument("--seed", type=int, default=1, help="of draw")
    given = arguments.parse_intermixed_args()
    if given.what == "draw":
        mutants = draw(int(given.names[0]), given.seed)
        build(mutants, given.jobs, joined=False)
        return run(mutants, given.jobs, WORK / "drawn.tsv")
    mutants = table.load()
    wrong = table.check(mutants, ROOT)
    if given.what == "check" or wrong:
        print("\n".join(wrong) or f"{len(mutants)} mutants, each where the table says")
        return 1 if wrong else 0
    build(mutants, given.jobs, joined=True)
    wanted = [m for m in mutants if not given.names or any(m.id == name or m.file.startswith(name) for name in given.names)]
    return run(wanted, given.jobs, WORK / "result.tsv")


if __name__ == "__main__":
    sys.exit(main())
