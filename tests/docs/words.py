#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Documents are in plain words: in every tracked .md file no sentence, and no clause of a table's cell, has more than 35
words. Code and equations in `…` count as one word; indented and fenced blocks are left out.

words.py SOURCE_DIR
"""
import pathlib
import re
import subprocess
import sys

MOST = 35


def blocks(text: str):
    """(line, text) of each paragraph, list entry and table cell; code is left out."""
    paragraph, start, fenced = [], 0, False
    for n, line in enumerate(text.splitlines() + [""], 1):
        if line.startswith("```"):
            fenced = not fenced
        code = fenced or line.startswith("```") or line.startswith("    ") or line.startswith("→")
        table, heading, entry = line.startswith("|"), line.startswith("#"), re.match(r"(- |\d+\. )", line)
        if not line.strip() or code or table or heading or entry:
            if paragraph:
                yield start, " ".join(paragraph)
            paragraph = []
        if table and not code:
            for cell in re.split(r"(?<!\\)\|", line.strip()[1:-1]):
                for clause in re.split(r";\s", cell):
                    yield n, clause
        elif line.strip() and not code and not heading:
            start = n if not paragraph else start
            paragraph.append(line.strip())


def main() -> int:
    wrong = 0
    source = pathlib.Path(sys.argv[1])
    tracked = subprocess.run(["git", "-C", source, "ls-files", "-z", "*.md"], check=True, capture_output=True, text=True)
    pages = [name for name in tracked.stdout.split("\0") if name]
    assert pages, "no document is tracked"
    for page in pages:
        for n, block in blocks((source / page).read_text()):
            # An abbreviation or a number is no end: a sentence ends before a capital or at the block's end.
            for sentence in re.split(r"[.:?!]\*{0,2}\s+(?=[A-ZΣΔ`*0-9(\[|])|\s→\s", re.sub(r"`[^`]*`", "X", block)):
                words = [w for w in sentence.split() if re.search(r"\w", w)]
                if len(words) > MOST:
                    wrong += 1
                    print(f"{page}:{n}: {len(words)} words: {sentence[:90]} …")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
