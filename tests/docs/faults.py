#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/faults.md: every row from 1 to the last is there once, and every test that a row names exists. So do those that
SECURITY.md names.

faults.py SOURCE_DIR BUILD_DIR    (the build tells its tests by ctest -N)
"""
import fnmatch
import pathlib
import re
import subprocess
import sys

ROWS = 63


def known_tests(build: str) -> list[str]:
    listing = subprocess.run(["ctest", "-N", "--test-dir", build], capture_output=True, text=True, check=True).stdout
    return re.findall(r"Test +#\d+: (\S+)", listing)


def nightly_parts(source: pathlib.Path) -> set[str]:
    script = (source / "tests/nightly/realtime.sh").read_text()
    return set(re.findall(r"^(\w+)\(\) ?\{", script, re.M))


def rows_of(text: str):
    """Number ('' for a second line of a row), and the last cell, of each row of a table of faults."""
    for line in text.splitlines():
        cells = [c.strip() for c in re.split(r"(?<!\\)\|", line.strip())[1:-1]]
        if len(cells) == 5 and re.fullmatch(r"\d*", cells[0]):
            yield cells


def main() -> int:
    source, build = pathlib.Path(sys.argv[1]), sys.argv[2]
    text = (source / "docs/faults.md").read_text()
    tests, parts = known_tests(build), nightly_parts(source)
    wrong, numbers = [], []
    wrong += [f"{t} is named by a row's number, which says nothing of what it claims" for t in tests if re.search(r"\b[Rr]ow_?\d", t)]
    if not tests:
        wrong.append("ctest -N tells of no tests: build first")
    for number, fault, _, reaction, named in rows_of(text):
        if number:
            numbers.append(int(number))
        names = re.findall(r"`([^`]+)`", named)
        nightly = re.findall(r"\bnightly (\w+)", named)
        if not names and not nightly and "**not built**" not in reaction:
            wrong.append(f"row {number}, {fault}: names no test")
        wrong += [f"row {number}: no test is called {n}" for n in names if not fnmatch.filter(tests, n)]
        wrong += [f"row {number}: tests/nightly/realtime.sh has no part {p}" for p in nightly if p not in parts]
    both = text + (source / "SECURITY.md").read_text()
    for token in re.findall(r"`(\*?[A-Za-z0-9]+\.[A-Z*][A-Za-z0-9*]*|(?:daemon|attack|systemd)_\w+)`", both):
        if not fnmatch.filter(tests, token):
            wrong.append(f"no test is called {token}")
    wrong += [f"row {n} is there {numbers.count(n)} times" for n in range(1, ROWS + 1) if numbers.count(n) != 1]
    wrong += [f"row {n} is not among 1 … {ROWS}" for n in numbers if not 1 <= n <= ROWS]
    for line in dict.fromkeys(wrong):
        print(f"docs/faults.md or SECURITY.md: {line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
