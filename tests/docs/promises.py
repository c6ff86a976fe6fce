#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What core/study/README.md promises of names and sizes is what the rows of docs/measurements/confusion.md show.

promises.py SOURCE_DIR
"""
import pathlib
import re
import sys

COUNT = r"(\d+)/(\d+) [^|]*"


def rows(text: str) -> dict[str, list[tuple[int, int]]]:
    """Hidden → right name alone, truth in what is reported, wrong name, interval covers size, as (so many, of so many)."""
    found = re.findall(rf"^\| ([\w ,]+) \| {COUNT}\| {COUNT}\| {COUNT}\| [^|]*\| (?:{COUNT}|–[^|]*)\|", text, re.M)
    return {row[0]: [(int(n or 0), int(of or 0)) for n, of in zip(row[1::2], row[2::2])] for row in found}


def main() -> int:
    study = pathlib.Path(sys.argv[1]) / "core/study"
    all_ = rows((study.parents[1] / "docs/measurements/confusion.md").read_text())
    causes = {name: row for name, row in all_.items() if re.fullmatch(r"[a-z_]+", name) and name not in ("unknown", "none")}
    alike = {name: row for name, row in all_.items() if "," in name}
    if len(causes) < 15 or len(alike) < 3 or "none" not in all_:
        print(f"docs/measurements/confusion.md: only {len(causes)} causes and {len(alike)} confounded rows were read")
        return 1
    right, wrong = [row[0][0] for row in causes.values()], [row[2][0] for row in causes.values()]
    worlds = {row[0][1] for row in causes.values()}
    told = min((row[1] for row in alike.values()), key=lambda share: share[0] / share[1])
    covered = {name: row[3][0] / row[3][1] for name, row in causes.items() if row[3][1]}
    worst = sorted(covered, key=covered.get)[:2]
    expected = [
        f"| in {min(right)} to {max(right)} of {max(worlds)} worlds, by cause |",
        f"| in at most {max(wrong)} of {max(worlds)} worlds of each cause |",
        f"| in {all_['none'][2][0]} of {all_['none'][2][1]} worlds;",
        f"| in at least {told[0]} of {told[1]} worlds |",
        f"worst are {worst[0]} ({covered[worst[0]]:.2f}) and {worst[1]} ({covered[worst[1]]:.2f}",
    ]
    page = (study / "README.md").read_text()
    missing = [text for text in expected if text not in page] + ([] if len(worlds) == 1 else [f"one number of worlds, not {worlds}"])
    for text in missing:
        print(f"core/study/README.md does not say '{text}'")
    return 1 if missing else 0


if __name__ == "__main__":
    sys.exit(main())
