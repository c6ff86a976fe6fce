# SPDX-License-Identifier: BSD-3-Clause
"""The tests of the build, each in a process of its own as ctest runs it, and which switches each of them passes.

What a test does cannot depend on a mutant whose switch it does not pass. So a mutant that no test has killed was tried
against all of them, though only those that pass its switch were run.
"""
import contextlib
import fnmatch
import hashlib
import json
import os
import pathlib
import subprocess
import tempfile
import threading
import time
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


def end_if_it_waits(process: subprocess.Popen, seconds: int, ended_yet: threading.Event) -> None:
    """Kills a process that has waited so long, not counting what it waited for a processor."""
    begun = time.monotonic()
    while not ended_yet.wait(seconds / 20):
        delayed = 0
        for task in pathlib.Path(f"/proc/{process.pid}/task").glob("*/schedstat"):
            with contextlib.suppress(OSError):
                delayed += int(task.read_text().split()[1])
        if time.monotonic() - begun - delayed * 1e-9 > seconds and not ended_yet.is_set():
            return process.kill()


def run(program: pathlib.Path, name: str, limit: int, environment: dict[str, str]) -> tuple[str, float]:
    """'' if the test passes, else what failed; and the processor time that it took, s. More than `limit` of it is a
    hang, and so are ten times as many seconds of waiting for anything but a processor."""
    command = [str(program), f"--gtest_filter={name}", "--gtest_fail_fast", "--gtest_brief=1"]
    with subprocess.Popen(["/bin/sh", "-c", f'ulimit -t {limit}; exec "$@"', "sh", *command],
                          stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          env=os.environ | ENVIRONMENT | environment) as process:
        ended_yet = threading.Event()
        threading.Thread(target=end_if_it_waits, args=(process, 10 * limit, ended_yet), daemon=True).start()
        _, status, used = os.wait4(process.pid, 0)
        ended_yet.set()
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
    with tempfile.NamedTemporaryFile(dir="/dev/shm") as marks:  # memory: a test that counts page faults passes it too
        marks.truncate(MARKS)
        for _ in range(2):
            ended, seconds = run(program, name, LONGEST, {"BACKWASH_MUTANTS_PASSED": marks.name})
            if not ended:
                marks.seek(0)
                return Test(program.name, name, seconds, {n for n, b in enumerate(marks.read()) if b})
    print(f"left out: {program.name} {name} {ended} without a mutant", flush=True)
    return None


class Suite:
    """The tests of some programs. Each is seen without a mutant when it is first asked for, and remembered for as long
    as its program stays as it is."""

    def __init__(self, folder: pathlib.Path, programs: list[str], cache: pathlib.Path):
        self.folder, self.cache, self.lock = folder, cache, threading.Lock()
        known = json.loads(cache.read_text()) if cache.exists() else {}
        self.seen: dict[str, dict] = {}
        self.names: dict[str, list[str]] = {}
        self.tests: dict[tuple[str, str], Test | None] = {}
        for name in programs:
            digest = hashlib.sha256((folder / name).read_bytes()).hexdigest()
            same = known.get(name, {}).get("digest") == digest
            self.seen[name] = {"digest": digest, "tests": known[name]["tests"] if same else {}}
            self.names[name] = names(folder / name)
            for test, (seconds, marks) in self.seen[name]["tests"].items():
                self.tests[name, test] = Test(name, test, seconds, set(marks))

    def test(self, program: str, name: str) -> Test | None:
        """None: it fails without a mutant."""
        if (program, name) not in self.tests:
            test = observe(self.folder / program, name)
            with self.lock:
                self.tests[program, name] = test
                if test:
                    self.seen[program]["tests"][name] = [test.seconds, sorted(test.marks)]
                    self.cache.write_text(json.dumps(self.seen))
        return self.tests[program, name]

    def chosen(self, spec: str) -> list[tuple[str, str]]:
        """The tests that "PROGRAM FILTER" chooses, as --gtest_filter would; those known to be quick first."""
        program, _, patterns = spec.partition(" ")
        found = [(program, n) for n in self.names[program]
                 if any(fnmatch.fnmatchcase(n, p) for p in (patterns or "*").split(":"))]
        return sorted(found, key=lambda t: self.tests[t].seconds if self.tests.get(t) else 1.0)
