#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""skipped.py BUILD [LIST [--again]]: names each test that ctest's last run in BUILD skipped, and why.

Exit 1 where one gives no reason that a machine can have (tests/support/skip.sh); with LIST, also where one is not in it. A line
of LIST is a test's name, a space and the reason; it has five lines at most. --again: what is to be tried again is printed alone, as
an expression for ctest -R: what failed, and what only a machine that stood still skipped, which then need not be in LIST.
"""
import pathlib
import re
import sys
from xml.etree import ElementTree

KINDS = ("right", "device", "kernel", "network", "stalled", "sanitizer", "data")
REASON = re.compile(rf"(?:skipped: |Skipped\n)((?:{'|'.join(KINDS)}): .*)")


def skipped(results: pathlib.Path) -> dict[str, str | None]:
    """Reason by test; None where it gave none."""
    told = {}
    for case in ElementTree.parse(results).iter("testcase"):
        if case.get("status") not in ("notrun", "disabled") and case.find("skipped") is None:
            continue
        reasons = REASON.findall(case.findtext("system-out") or "")
        told[case.get("name")] = reasons[-1].strip() if reasons else None
    return told


def failed(results: pathlib.Path) -> list[str]:
    """Names of the tests that failed."""
    return [case.get("name") for case in ElementTree.parse(results).iter("testcase") if case.find("failure") is not None]


def main() -> int:
    results = pathlib.Path(sys.argv[1]) / "tests.xml"
    told = skipped(results) if results.exists() else {}
    allowed = None
    if len(sys.argv) > 2:
        lines = [line.partition("#")[0].split(maxsplit=1) for line in pathlib.Path(sys.argv[2]).read_text(encoding="utf-8").splitlines()]
        allowed = dict(line for line in lines if line)
        if len(allowed) > 5:
            print(f"{sys.argv[2]}: {len(allowed)} tests may be skipped, five at most")
            return 1
    wrong = 0
    again = []
    if len(sys.argv) > 3 and results.exists():
        again = sorted([name for name, reason in told.items() if (reason or "").startswith("stalled: ")] + failed(results))
        print("|".join(f"^{re.escape(name)}$" for name in again))
    for name, reason in sorted(told.items()):
        complaint = ""
        if reason is None:
            complaint = " <- FAILED: a test is skipped for what this machine cannot do, and says so"
        elif allowed is not None and name not in allowed and name not in again:
            complaint = f" <- FAILED: not in {sys.argv[2]}"
        wrong += bool(complaint)
        print(f"skipped: {name}: {reason or 'no reason'}{complaint}", file=sys.stderr if len(sys.argv) > 3 else sys.stdout)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
