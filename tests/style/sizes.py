#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Files of code and scripts hold at most 300 lines, functions of production at most 50 (from the head to the closing brace). Files with tests are
named X_test.cpp, in tests/fuzz also X_fuzz.cpp.

sizes.py SOURCE_DIR [--longest]    --longest: the ten longest functions, too
"""
import pathlib
import re
import sys

NO_CODE = re.compile(r"//[^\n]*|/\*.*?\*/|R\"\w*\(.*?\)\w*\"|\"(?:\\.|[^\"\\\n])*\"|(?<![\w'])'(?:\\.|[^'\\\n])'", re.S)
SCOPE = re.compile(r"\b(?:namespace|class|struct|enum|union|extern)\b[^()=]*$")
FUNCTION = re.compile(r"\)[^=]*$")


def functions_of(text: str):
    """(lines, head) of what is defined in namespaces and types; what stands within a function belongs to it."""
    def blank(found: re.Match) -> str:
        return re.sub(r"[^\n]", " ", found[0])

    code = re.sub(r"^ *#(?:.*\\\n)*.*$", blank, NO_CODE.sub(blank, text), flags=re.M)
    scopes: list[tuple[bool, int]] = []  # whether it holds definitions, where its head begins
    begin = 0
    for match in re.finditer(r"[;{}]", code):
        head = code[begin:match.start()]
        if match[0] == "{":
            outside = all(scope for scope, _ in scopes)
            scopes.append((outside and (bool(SCOPE.search(head)) or not FUNCTION.search(head)), begin + len(head) - len(head.lstrip())))
        elif match[0] == "}" and scopes:
            scope, at = scopes.pop()
            if not scope and all(outer for outer, _ in scopes):
                yield code.count("\n", at, match.start()) + 1, text[at:at + 60].split("{")[0].split("\n")[0]
        begin = match.end()


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    wrong, all_functions, files = [], [], 0
    for folder in ("core", "firmware_bridge", "services", "tests"):
        for path in sorted((root / folder).rglob("*")):
            if path.suffix not in (".cpp", ".hpp", ".c", ".h", ".py", ".sh"):
                continue
            text, name = path.read_text(), str(path.relative_to(root))
            files += 1
            if (lines := text.count("\n")) > 300:
                wrong.append(f"{name} has {lines} lines")
            if path.suffix in (".py", ".sh"):
                continue
            if folder != "tests":
                all_functions += [(count, name, head) for count, head in functions_of(text)]
            elif re.search(r"^(?:TYPED_)?TEST(?:_[FP])?\(", text, re.M):
                if not re.search(r"_test\.[ch]pp$" if "fuzz" not in name else r"_(?:test|fuzz)\.cpp$", name):
                    wrong.append(f"{name} holds tests and is not named X_test.cpp")
    wrong += [f"{name}: {count} lines of {head}" for count, name, head in all_functions if count > 50]
    if files < 900 or len(all_functions) < 3000:
        wrong.append(f"only {files} files and {len(all_functions)} functions were found")
    for line in wrong:
        print(line)
    if "--longest" in sys.argv:
        for count, name, head in sorted(all_functions, reverse=True)[:10]:
            print(count, name, head)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
