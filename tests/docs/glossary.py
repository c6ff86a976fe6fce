#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/glossary.md: each word is used by another document, has a meaning of one sentence, stands once, in the order of the
alphabet (Greek letters by their names, marks left out), and names where it is defined. Every document that it points to uses it.

What two documents or more write in capitals as an abbreviation stands in it, except EVERYDAY and the messages of
docs/interfaces.md. Fenced blocks, code in `…` and targets of links are left out.

glossary.py SOURCE_DIR
"""
import pathlib
import re
import subprocess
import sys

# What any reader of such documents knows, and what other people's programs call their modes.
EVERYDAY = set("AMD BRAKE CONTRIBUTING CPU CSV DDS EPYC FIR GB GNU GPIO GUIDED HITL HTML ICRA JSON LAND LAS LED LOITER MB MCAP NED OBJ PCD PLY "
               "POSCTL RC README ROS RTL SECURITY SI SIH STABILIZE STL TCP TOML UART UDP USB VIO VSLAM".split())
ABBREVIATION = re.compile(r"(?<![\w./-])([A-Z]{2,})s?(?![\w/-])")
SPOKEN = {"κ": "kappa", "Σ": "sigma", "τ_w": "tau", "w̄": "w bar"}


def uses(text: str, word: str) -> bool:
    return re.search(rf"(?<!\w){re.escape(word)}s?(?![\w-])", text, re.I) is not None


def prose(text: str) -> str:
    text = re.sub(r"^(```|~~~).*?^\1", " ", text, flags=re.M | re.S)
    return re.sub(r"\]\([^)]*\)", "]", re.sub(r"`[^`]*`", " ", text))


def missing(pages: dict[str, str], words: list[str]) -> list[str]:
    text = {name: prose(page) for name, page in pages.items()}
    known = {word.lower() for word in words}
    messages = set(re.findall(r"\b[A-Z]+\b", pages["docs/interfaces.md"].partition("## MAVLink")[2]))
    written: dict[str, int] = {}
    for page in text.values():
        for word in set(ABBREVIATION.findall(page)):
            written[word] = written.get(word, 0) + 1
    wrong = [f"'{word}' is used by {count} documents and is not here" for word, count in sorted(written.items())
             if count >= 2 and word.lower() not in known | {w.lower() for w in EVERYDAY | messages} and not word.startswith("SIG")]
    return wrong


def main() -> int:
    source = pathlib.Path(sys.argv[1])
    tracked = subprocess.run(["git", "-C", source, "ls-files", "-z", "*.md"], check=True, capture_output=True, text=True)
    glossary = source / "docs/glossary.md"
    pages = {name: (source / name).read_text() for name in tracked.stdout.split("\0") if name and source / name != glossary}
    rows = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in glossary.read_text().splitlines()
            if line.startswith("| ") and not line.startswith(("| ---", "| word"))]
    wrong = [] if len(rows) >= 20 else [f"{len(rows)} words"]
    words = [word for word, *_ in rows]
    ordered = sorted(words, key=lambda w: SPOKEN.get(w, w).lower())
    wrong += [f"'{a}' stands where '{b}' belongs" for a, b in zip(words, ordered) if a != b][:1]
    wrong += [f"'{word}' stands twice" for word in set(words) if words.count(word) > 1]
    wrong += missing(pages, words)
    for word, meaning, place in rows:
        if not any(uses(text, word) for text in pages.values()):
            wrong.append(f"no document uses '{word}'")
        if not meaning or re.search(r"[.?!] [A-Z]|\.$", meaning):
            wrong.append(f"'{word}': not one plain sentence: {meaning}")
        link = re.search(r"\]\(([^)]*)\)", place)
        target = link and (glossary.parent / link[1]).resolve()
        if not target or not target.is_file():
            wrong.append(f"'{word}': no document where it is defined: {place}")
        elif not uses(target.read_text(), word):
            wrong.append(f"'{word}': {link[1]} does not use it")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
