# SPDX-License-Identifier: BSD-3-Clause
"""How checks read a page of docs/, and what they found wrong with it."""
import re

wrong: list[str] = []


def expect(where: str, documented: set, actual: set) -> None:
    wrong.extend(f"{where}: not documented: {x}" for x in sorted(actual - documented))
    wrong.extend(f"{where}: does not exist: {x}" for x in sorted(documented - actual))


def sections(text: str) -> dict[str, str]:
    """Each heading's own text, without that of the headings below it."""
    parts = re.split(r"^#+ (.*)$", text, flags=re.M)
    return dict(zip(parts[1::2], parts[2::2]))


def rows(section: str) -> list[list[str]]:
    lines = [line for line in section.splitlines() if line.startswith("|") and not re.fullmatch(r"[| -]+", line)]
    return [[c.strip() for c in re.split(r"(?<!\\)\|", line.strip()[1:-1])] for line in lines]


def quoted(text: str) -> list[str]:
    return re.findall(r"`([^`]+)`", text)
