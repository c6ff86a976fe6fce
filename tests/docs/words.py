#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Documents are in plain words: in every tracked .md file no sentence, no heading, and no clause of a table's cell, has
more than 35 words. Code and equations in `…` count as one word, words on both sides of a dash as two. A colon before
a capital, a number or code ends a sentence, and so does an arrow. Fenced blocks are
left out, and indented ones: indented by four columns, after a blank line, and not under an entry of a list.

words.py SOURCE_DIR
"""
import pathlib
import re
import subprocess
import sys

MOST = 35
ABBREVIATION = re.compile(r"\b(e\.g|i\.e|cf|vs|etc|approx|Fig|Figs|Eq|Eqs|No|Sec|Ch|Dr|Prof|St)\.(?=\s)")


def blocks(text: str):
    """(line, text) of each paragraph, heading, list entry and table cell; code is left out."""
    paragraph, start, fenced, indented, listed = [], 0, "", False, False
    for n, line in enumerate(text.splitlines() + [""], 1):
        fence = re.match(r"\s*(```|~~~)(?!.*`)", line)
        if fence and fenced in ("", fence[1]):
            fenced = "" if fenced else fence[1]
        entry = re.match(r"\s*([-*+] |\d+[.)] )", line)
        # Four columns are code at the start of a block only; below an entry they carry it on.
        indented = line.startswith(("    ", "\t")) and (indented or not paragraph) and not listed
        listed = bool(entry and not indented) or listed and (not line.strip() or line.startswith((" ", "\t")) or bool(paragraph))
        code = bool(fenced or fence or indented) or line.startswith("→ `")
        table, heading = line.startswith("|"), line.startswith("#") and not code
        if heading:
            yield n, line.lstrip("# ")
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
            plain = ABBREVIATION.sub(r"\1", re.sub(r"`[^`]*`", "X", block))
            for sentence in re.split(r"[.:?!]\*{0,2}\s+(?=[A-ZΣΔ`*0-9(\[|])|\s→\s", plain):
                words = [w for w in re.split(r"\s|—|–(?!\d)", sentence) if re.search(r"\w", w)]
                if len(words) > MOST:
                    wrong += 1
                    print(f"{page}:{n}: {len(words)} words: {sentence[:90]} …")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
