# SPDX-License-Identifier: BSD-3-Clause
"""The tests of the build, each in a process of its own as ctest runs it, and which switches each of them passes.

What a test does cannot depend on a mutant whose switch it does not pass. So a mutant that no test has killed was tried
against all of them, though only those that pass its switch were run.
"""
import concurrent.futures
import hashlib
import json
import os
import pathlib
import subprocess
import tempfile
import threading
from dataclasses import dataclass

MARKS = 65536  # of switch.h
LONGEST = 600  # s of processor time that a test may take without a mutant
# All orders of events to this depth: beyond it each more takes eight times as long.
ENVIRONMENT = {"BACKWASH_MODEL_DEPTH": "5"}


@dataclass
class Test:
    """One test of one program, as it is without a mutant."""
    program: str
    name: str
    seconds: float  # of processor time
    marks: set[int]

    def __str__(self) -> str:
        return f"{self.program} {self.name}"

    def passes(self, number: int) -> bool:
        """Whether it passes the switch of this mutant, or of one with the same mark."""
        return number % MARKS in self.marks

    @property
    def limit(self) -> int:
        """Of processor time, s: more is a hang."""
        return 10 + int(8 * self.seconds)


def run(program: pathlib.Path, name: str, limit: int, environment: dict[str, str]) -> tuple[str, float]:
    """'' if the test passes, else what failed; and the processor time that it took, s. More than `limit` of it is a hang,
    and so are ten times as many seconds of waiting: the machine's load does not look like one."""
    command = [str(program), f"--gtest_filter={name}", "--gtest_fail_fast", "--gtest_brief=1"]
    with subprocess.Popen(["/bin/sh", "-c", f'ulimit -t {limit}; exec "$@"', "sh", *command],
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          env=os.environ | ENVIRONMENT | environment) as process:
        watchdog = threading.Timer(10 * limit, process.kill)
        watchdog.start()
        _, status, used = os.wait4(process.pid, 0)
        watchdog.cancel()
        process.returncode = os.waitstatus_to_exitcode(status)
    seconds = used.ru_utime + used.ru_stime
    ended = {0: "", 1: "fails"}.get(process.returncode, f"ends with {process.returncode}")
    return ended, seconds


def names(program: pathlib.Path) -> list[str]:
    """Of all tests that a program has and that are not disabled."""
    listed = subprocess.run([str(program), "--gtest_list_tests"], check=True, capture_output=True, text=True).stdout
    found, suite = [], ""
    for line in listed.splitlines():
        word = line.split("#")[0].rstrip()
        if line.startswith("  "):
            found.append(suite + word.strip())
        elif word.endswith("."):
            suite = word
    return [name for name in found if "DISABLED_" not in name]


def observe(program: pathlib.Path, name: str) -> Test | None:
    """One test without a mutant. A second try is allowed, for tests that meet the wall clock on a loaded machine; None:
    it fails then too, and says nothing of any mutant."""
    with tempfile.NamedTemporaryFile() as marks:
        marks.truncate(MARKS)
        for _ in range(2):
            ended, seconds = run(program, name, LONGEST, {"BACKWASH_MUTANTS_PASSED": marks.name})
            if not ended:
                marks.seek(0)
                return Test(program.name, name, seconds, {n for n, b in enumerate(marks.read()) if b})
    print(f"left out: {program.name} {name} {ended} without a mutant", flush=True)
    return None


def survey(programs: list[pathlib.Path], cache: pathlib.Path, jobs: int) -> list[Test]:
    """All tests of these programs, the quickest first. What was seen of the same program before is not run again."""
    known = json.loads(cache.read_text()) if cache.exists() else {}
    tests = []
    for program in programs:
        digest = hashlib.sha256(program.read_bytes()).hexdigest()
        if known.get(program.name, {}).get("digest") != digest:
            with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
                seen = list(pool.map(lambda name, p=program: observe(p, name), names(program)))
            good = [t for t in seen if t]
            whole = digest if len(good) == len(seen) else ""  # else it is asked again the next time
            known[program.name] = {"digest": whole, "tests": [[t.name, t.seconds, sorted(t.marks)] for t in good]}
            cache.write_text(json.dumps(known))
            print(f"{program.name}: {len(good)} of {len(seen)} tests, {sum(t.seconds for t in good):.0f} s", flush=True)
        tests += [Test(program.name, name, seconds, set(marks))
                  for name, seconds, marks in known[program.name]["tests"]]
    return sorted(tests, key=lambda t: t.seconds)
