#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/guide.md says what the programs say: each message of its table is a text of the source, and every refusal of the mission
is there; its table of reasons has each of core/types/mode.hpp once; its table of the vehicle file names each key of
docs/interfaces.md; and what stands in its fenced blocks is what tests/system/guide.sh runs (commands()).

guide.py SOURCE_DIR [BUILD_DIR]
"""
import pathlib
import re
import sys

from page import expect, quoted, rows, sections, wrong

MISSION = ("services/backwashd/plan/mission.cpp", "services/backwashd/plan/mission.cpp")
LITERAL = r'"((?:[^"\\\n]|\\.)*)"'


def commands(text: str) -> str:
    """The fenced blocks of the page in their order: one script."""
    return "\n".join(re.findall(r"^```\n(.*?)^```$", text, re.M | re.S))


def printed(text: str) -> list[str]:
    """What the section "Read a study" says in `…` with a colon and a blank: lines that its commands print."""
    return re.findall(r"`([^`\n]+: [^`\n]+)`", sections(text)["Read a study"])


def literals(code: str) -> list[str]:
    """String literals, adjacent ones as one."""
    return ["".join(re.findall(LITERAL, run[0])) for run in re.finditer(rf"(?:{LITERAL}\s*)+", code)]


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    page = (root / "docs/guide.md").read_text()
    part = sections(page)
    texts = {text for folder in ("core", "services", "firmware_bridge") for source in (root / folder).rglob("*.cpp")
             for text in literals(source.read_text())}
    told = [quoted(row[0]) for row in rows(part["Troubleshooting by message"])[1:]]
    if len(told) < 20 or not all(told):
        wrong.append("the table of messages has a row without a message")
    messages = {message for cell in told for message in cell}
    for message in sorted(messages):
        for piece in filter(None, message.split("…")):
            if not any(piece in text for text in texts):
                wrong.append(f"no program says '{piece}'")
    refusals = {text for source in MISSION for text in re.findall(rf"refused\((?:std::string\()?{LITERAL}", (root / source).read_text())}
    if len(refusals) < 15:
        wrong.append(f"only {len(refusals)} refusals of the mission were found")
    wrong.extend(f"the mission's '{text}' is not in the table" for text in sorted(refusals)
                 if not any(message.partition("…")[0] == text for message in messages))
    modes = (root / "core/types/mode.hpp").read_text()
    reasons = set(re.findall(LITERAL, re.search(r"kReasonNames\{(.*?)\};", modes, re.S)[1]))
    listed = [reason for row in rows(part["In flight: what to do"])[1:] for reason in row[0].split("; ")]
    expect("reasons", set(listed), reasons)
    wrong.extend(f"reason '{r}' stands twice" for r in set(listed) if listed.count(r) > 1)
    keys = {k for line in sections((root / "docs/interfaces.md").read_text())["Vehicle file"].splitlines() if line.startswith("- `")
            for k in quoted(line.partition(" (")[0])}
    named = {k for row in rows(part["Your vehicle"])[1:] for k in quoted(row[0])}
    for key in sorted(keys - {"name"}):  # .horizontal and .vertical are one subject, and the autopilot's own gains are those of kp and kd
        stem = re.sub(r"\.(horizontal|vertical)$", "", key)
        if stem not in named and not stem.startswith("controller.px4"):
            wrong.append(f"the guide does not say what a wrong {stem} does")
    if len(printed(page)) < 3:
        wrong.append("Read a study says hardly anything that its commands print")
    if commands(page).count("\n") < 30:
        wrong.append("the guide has hardly any commands")
    for line in dict.fromkeys(wrong):
        print(f"docs/guide.md: {line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
