#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A type has its name alone in its namespace: two of one name in two files are one type to the linker, whatever each file says.
Looked at are the classes and enumerations that core, firmware_bridge and services define in namespaces with a name. What is
defined as Outer::Inner belongs to one of several implementations, of which a build takes one.

types_once.py SOURCE_DIR
"""
import pathlib
import re
import sys

NO_CODE = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])'", re.S)
OPENS = re.compile(r"namespace\s*([\w:]*)\s*\{|(?:struct|class|enum(?: class)?)\s+([\w:]+)\s*(?:final\s*)?(?::[^;{}()]*)?\{|[{}]")


def types_of(code: str):
    """Qualified names of what is defined; what is in a function or a namespace without a name is its file's own."""
    open_: list[str | None] = []
    for match in OPENS.finditer(NO_CODE.sub(" ", code)):
        space, name = match[1], match[2]
        if match[0] == "}":
            if open_:
                open_.pop()
        elif match[0] == "{":
            open_.append(None)
        elif name is None:
            open_.append(space or None)
        else:
            if None not in open_ and "::" not in name:
                yield "::".join([*open_, name])
            open_.append(name)


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    files: dict[str, list[str]] = {}
    for folder in ("core", "firmware_bridge", "services", "research"):
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            for name in types_of(path.read_text()):
                files.setdefault(name, []).append(str(path.relative_to(root)))
    wrong = [f"{name} is defined in {' and '.join(where)}" for name, where in sorted(files.items()) if len(where) > 1]
    if not files:
        wrong.append("no types were found")
    for line in wrong:
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
