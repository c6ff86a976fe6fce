#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Mutation test of the safety-relevant code (README.md).

  mutants.py check              the table still fits the sources (seconds; a test of ./check)
  mutants.py build [PROGRAM …]  all mutants as switches of one build, in build/mutants
  mutants.py run [ID|PATH …]    which are killed; exit 1 if the score is below 0.97
"""
import argparse
import collections
import concurrent.futures
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

import table

ROOT = pathlib.Path(__file__).resolve().parents[2]
WORK = ROOT / "build" / "mutants"
TREE = WORK / "tree"
BIN = TREE / "build" / "release" / "tests"
COPIED = ["CMakeLists.txt", "CMakePresets.json", "README.md", "core", "firmware_bridge", "idl", "services", "tests"]
# Those that a mutant must survive to count as living, the quickest first.
PROGRAMS = ["test_config", "test_files", "test_track", "test_bridge", "test_map", "test_field", "test_reach", "test_daemon",
            "test_plan", "test_sim"]
LEAST_SCORE = 0.97


def build(mutants: list[table.Mutant], programs: list[str]) -> None:
    """Copies what changed, rewrites, compiles. A file is written only if its content differs: little is compiled."""
    wrong = table.check(mutants, ROOT)
    if wrong:
        sys.exit("\n".join(wrong))
    files = table.by_file(mutants)
    wanted = {}
    for top in COPIED:
        for path in [ROOT / top] if (ROOT / top).is_file() else sorted((ROOT / top).rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                wanted[str(path.relative_to(ROOT))] = path
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
    subprocess.run(["cmake", "--preset", "release"], cwd=TREE, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", "--preset", "release", "--target", *programs, "--", "-k", "0"],
                   cwd=TREE, check=True)


def run_test(spec: str, number: int, cpu_seconds: int) -> tuple[str, float]:
    """'' if the tests pass, else what failed first; and the processor time that they took, s. More than `cpu_seconds`
    of it is a hang, and so are ten times as many seconds of waiting: the machine's load does not look like one."""
    program, _, chosen = spec.partition(" ")
    command = [str(BIN / program), "--gtest_fail_fast", "--gtest_brief=1"]
    if chosen:
        command.append(f"--gtest_filter={chosen}")
    with tempfile.TemporaryFile() as output, subprocess.Popen(
            ["/bin/sh", "-c", f'ulimit -t {cpu_seconds}; exec "$@"', "sh", *command], stdout=output,
            stderr=subprocess.DEVNULL, env=os.environ | {"BACKWASH_MUTANT": str(number)}) as process:
        watchdog = threading.Timer(10 * cpu_seconds, process.kill)
        watchdog.start()
        _, status, used = os.wait4(process.pid, 0)
        watchdog.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds = used.ru_utime + used.ru_stime
        if process.returncode == 0:
            return "", seconds
        output.seek(0)
        failed = [line for line in output.read().decode(errors="replace").splitlines() if "[  FAILED  ]" in line]
    if failed:
        return f"{program} {failed[0].split(']')[1].split()[0].rstrip(',')}", seconds
    return f"{program} {chosen}: ended with {process.returncode}", seconds


class Baseline:
    """Processor time of each choice of tests without a mutant, s; it must pass. Measured when it is first asked for."""

    def __init__(self):
        self.seconds: dict[str, float] = {}
        self.locks = collections.defaultdict(threading.Lock)

    def limit(self, spec: str) -> int:
        """Of processor time, s: more is a hang."""
        with self.locks[spec]:
            if spec not in self.seconds:
                failed, self.seconds[spec] = run_test(spec, 0, 600)
                if failed:
                    print(f"without a mutant: {failed}", flush=True)
                    os._exit(1)  # from any thread: nothing that follows would mean anything
        return 10 + int(8 * self.seconds[spec])


def judge(mutant: table.Mutant, specs: list[str], baseline: Baseline) -> str:
    """What killed it, or ''."""
    for spec in specs:
        failed, _ = run_test(spec, mutant.number, baseline.limit(spec))
        if failed:
            return failed
    return ""


def rows_of(result: pathlib.Path) -> dict[str, list[str]]:
    """What an earlier run wrote of each mutant: id, file, verdict, by or why, promise."""
    lines = result.read_text().splitlines()[1:] if result.exists() else []
    return {line.split("\t")[0]: line.split("\t") for line in lines}


def killers(result: pathlib.Path) -> dict[str, list[str]]:
    """The one test that killed each mutant of an earlier run, if a test did: if it is still there, the quickest proof."""
    return {id: [row[3]] for id, row in rows_of(result).items() if row[2] == "killed" and len(row[3].split()) == 2}


def run(mutants: list[table.Mutant], jobs: int, quick: bool, result: pathlib.Path) -> int:
    """First what killed it the last time, then the tests that each row names, then all programs for those that live."""
    earlier = killers(result)
    passes = [lambda m: earlier.get(m.id, []), lambda m: m.tests] + ([] if quick else [lambda _: PROGRAMS])
    baseline = Baseline()
    killed: dict[str, str] = {}
    for specs in passes:
        todo = [m for m in mutants if m.id not in killed]
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            for mutant, by in zip(todo, pool.map(lambda m, s=specs: judge(m, s(m), baseline), todo)):
                if by:
                    killed[mutant.id] = by
                if by or specs is passes[-1]:
                    print(f"{mutant.id}: {by or 'lives'}", flush=True)
    return report(mutants, killed, result)


def report(mutants: list[table.Mutant], killed: dict[str, str], result: pathlib.Path) -> int:
    """Rows to `result`, the score per folder to the terminal."""
    def verdict(m: table.Mutant) -> str:
        return "killed" if m.id in killed else "equivalent" if m.equivalent else "real" if m.real else "lived"

    rows = rows_of(result)  # those that were not tried this time stay
    for m in mutants:
        rows[m.id] = [m.id, m.file, verdict(m), killed.get(m.id) or m.equivalent or m.real, m.promise]
    result.parent.mkdir(parents=True, exist_ok=True)
    result.write_text("\n".join("\t".join(row) for row in [["id", "file", "verdict", "by or why", "promise"],
                                                           *rows.values()]) + "\n")

    print(f"\n| {'sources':20} | mutants | killed | lived | equivalent | score |\n|---|---|---|---|---|---|")
    folders: dict[str, list[str]] = {}
    for m in mutants:
        folders.setdefault(str(pathlib.PurePath(m.file).parent), []).append(verdict(m))
    folders["all"] = [verdict(m) for m in mutants]
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
        if verdict(m) in ("lived", "real"):
            print(f"{m.id} lives: {m.promise} {m.real}")
    return 1 if score < LEAST_SCORE or wrong else 0


def main() -> int:
    """Command line."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("what", choices=["check", "build", "run"])
    arguments.add_argument("names", nargs="*", help="only these mutants, or those of these folders; programs to build")
    arguments.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments.add_argument("--quick", action="store_true", help="only the tests that the rows name")
    arguments.add_argument("--result", type=pathlib.Path, default=WORK / "result.tsv")
    given = arguments.parse_intermixed_args()
    mutants = table.load()
    if given.what == "check":
        wrong = table.check(mutants, ROOT)
        print("\n".join(wrong) or f"{len(mutants)} mutants, each where the table says")
        return 1 if wrong else 0
    if given.what == "build":
        build(mutants, given.names or PROGRAMS)
        return 0
    chosen = [m for m in mutants if not given.names or
              any(m.id == name or m.file.startswith(name) for name in given.names)]
    return run(chosen, given.jobs, given.quick, given.result)


if __name__ == "__main__":
    sys.exit(main())
