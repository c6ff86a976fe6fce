#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One class, one source: the members of a class of core, firmware_bridge or services are defined in one .cpp file. What is too large for
one is two classes. Looked at is no template and nothing in a header; X_v1.cpp and X_v2.cpp, of which a build takes one, count as one.

one_class.py SOURCE_DIR
"""
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from types_once import NO_CODE, types_of  # noqa: E402

SPACE = re.compile(r"^(?:inline )?namespace ([\w:]+) \{", re.M)
# A definition begins its line, as clang-format leaves it, and has a body or initialisers before any semicolon.
MEMBER = re.compile(r"^(?!namespace|using|template|static_assert|return)[\w:&*<>\[\], ]*?\b((?:\w+::)+)(?:~?\w+|operator[^\w\s(]+(?:\(\))?) ?"
                    r"\((?=[^;{}]*\{)", re.M)


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    paths = [p for folder in ("core", "firmware_bridge", "services") for p in sorted((root / folder).rglob("*.[ch]pp"))]
    texts = {str(p.relative_to(root)): NO_CODE.sub(" ", p.read_text()) for p in paths}
    classes = {name for text in texts.values() for name in types_of(text)}
    sources: dict[str, set[str]] = {}
    for file, text in texts.items():
        spaces = [m[1] for m in SPACE.finditer(text)]
        for member in MEMBER.finditer(text) if file.endswith(".cpp") else ():
            for name in (f"{space}::{member[1][:-2]}" for space in spaces):
                if name in classes:
                    sources.setdefault(name, set()).add(re.sub(r"_v\d+\.cpp$", ".cpp", file))
    wrong = [f"{name} is defined in {' and '.join(sorted(files))}" for name, files in sorted(sources.items()) if len(files) > 1]
    print("\n".join(wrong + ([] if sources else ["no member of a class was found"])))
    return 1 if wrong or not sources else 0


if __name__ == "__main__":
    sys.exit(main())
