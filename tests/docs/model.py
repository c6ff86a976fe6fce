#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/model.md: equations are numbered once each, and each is followed by the code that computes it, which exists: in the code,
not in a comment or a text. After an arrow stands nothing in code marks but `path:symbol`, and a number of an equation in bold
begins its line: what is spelled otherwise would not be read.
Each law of core/types/law.hpp has its equation, "name:   what it computes", and no equation of a law names another. Each kind of
core/types/simulation_term.hpp has its line in the table of kinds, with the ranges of its numbers.

model.py SOURCE_DIR
"""
import itertools
import pathlib
import re
import sys

CITATION = re.compile(r"`((?:core|services|firmware_bridge)/[\w./]+\.(?:cpp|hpp|c|h)):([\w:~]+)`")
NUMBER = re.compile(r"^(?:\*\*| {4,})(\d\w?(?:\.\d)?-\d+)\s")


def bare(code: str) -> str:
    """Code without its comments, of either kind, and without what its strings say."""
    return re.sub(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', lambda m: '""' if m[0][0] == '"' else " ", code, flags=re.S)


def names(code: str, symbol: str) -> bool:
    """Whether code has the symbol: Class::function as it is defined, or both names in a header."""
    code = bare(code)
    if re.search(rf"\b{re.escape(symbol)}\b", code):
        return True
    return "::" in symbol and all(re.search(rf"\b{re.escape(part)}\b", code) for part in symbol.split("::"))


def laws(source: pathlib.Path, equations: list[str]) -> list[str]:
    """What is wrong between the laws of the code and the equations 6-2 to 6-6 of the document."""
    known = set(re.findall(r'\.name = "(\w+)"', (source / "core/types/law.hpp").read_text()))
    heads = [head for line in equations if re.match(r" +6-[2-6] ", line) for head in re.findall(r"([a-z_]+(?:, [a-z_]+)*):   ", line)]
    told = {name for head in heads for name in head.split(", ")}
    wrong = [f"1: the law {name} has no equation" for name in sorted(known - told)]
    wrong += [f"1: {name} is no law of core/types/law.hpp" for name in sorted(told - known)]
    return wrong + ([] if len(known) >= 10 else [f"1: only {len(known)} laws were found"])


def kinds(source: pathlib.Path, text: str) -> list[str]:
    """What is wrong between the kinds of terms that the simulation alone knows and their table in section 6."""
    code = (source / "core/types/simulation_term.hpp").read_text()
    ranges = {name: f"[{low}, {high}]" for name, low, high in re.findall(r"TermRange (k\w+)\{([\d.-]+), ([\d.-]+)\}", code)}
    known = {}
    for name, numbers in re.findall(r'\{Kind::\w+,\s*"(\w+)",\s*\{([^}]*)\}', code):
        runs = [(ranges[r], len(list(same))) for r, same in itertools.groupby(re.split(r",\s*", numbers.strip()))]
        known[name] = ", ".join(f"{count} × {r}" if count > 1 else r for r, count in runs)
    table = text.partition("| kind | `value` |")[2].partition("\n\n")[0]
    told = dict(re.findall(r"^\| `(\w+)` \| [^|]* \| ([^|]*) \|", table, re.M))
    wrong = [f"1: the kind {name} has no line in the table of section 6" for name in sorted(known.keys() - told.keys())]
    wrong += [f"1: {name} is no kind of core/types/simulation_term.hpp" for name in sorted(told.keys() - known.keys())]
    wrong += [f"1: the kind {name} has the ranges {known[name]}" for name in sorted(known.keys() & told.keys()) if known[name] != told[name]]
    return wrong + ([] if len(known) >= 10 else [f"1: only {len(known)} kinds were found"])


def ranked(number: str) -> list[str]:
    return [part.rjust(4) for part in re.split(r"[.-]", number)]


def main() -> int:
    source = pathlib.Path(sys.argv[1])
    wrong, seen, open_equations = [], {}, []
    section, blank = "", False

    def close():
        wrong.extend(f"{at}: nothing says what computes equation {number}" for at, number in open_equations)
        open_equations.clear()

    for n, line in enumerate((source / "docs/model.md").read_text().splitlines(), 1):
        if heading := re.match(r"#+ (\d\w?(?:\.\d)?)?", line):
            close()
            section = heading[1] or ""
        if not line:
            blank = True
        if equation := NUMBER.match(line):
            if blank:  # equations of one block share an arrow
                close()
            number, blank = equation[1], False
            if number in seen:
                wrong.append(f"{n}: equation {number} is also in line {seen[number]}")
            if number.rsplit("-", 1)[0].split(".")[0] != section.split(".")[0]:
                wrong.append(f"{n}: equation {number} is in section {section}")
            seen[number] = n
            open_equations.append((n, number))
        citations = CITATION.findall(line)
        if line.startswith("→"):
            open_equations.clear()
            if not citations or len(citations) < line.count("`") // 2:
                wrong.append(f"{n}: not only `path:symbol` after the arrow")
        elif re.search(r"(?<!^)\*\*\d\w?(?:\.\d)?-\d+\b", line):
            wrong.append(f"{n}: an equation's number that does not begin its line")
        for path, symbol in citations:
            file = source / path
            if not file.is_file():
                wrong.append(f"{n}: there is no {path}")
            elif not names(file.read_text(), symbol):
                wrong.append(f"{n}: {path} has no {symbol}")
    # The table at the top names each section's first and last equation.
    for first, last in re.findall(r"^\| \[[^|]*\|[^|]*\| (\S+-\d+) … (\S+-\d+) \|", (source / "docs/model.md").read_text(), re.M):
        group = [number for number in seen if number.split("-")[0].split(".")[0] == first.split("-")[0].split(".")[0]]
        ends = [min(group, key=ranked), max(group, key=ranked)] if group else []
        if ends != [first, last]:
            wrong.append(f"1: the table says {first} … {last}, there are {' … '.join(ends)}")
    wrong += laws(source, (source / "docs/model.md").read_text().splitlines())
    wrong += kinds(source, (source / "docs/model.md").read_text())
    if len(seen) < 50:
        wrong.append(f"1: only {len(seen)} equations were found")
    for line in wrong:
        print(f"docs/model.md:{line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
