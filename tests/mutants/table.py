# SPDX-License-Identifier: BSD-3-Clause
"""The table of mutants: the *.toml files beside this one, checked against the sources, and the sources rewritten.

A source's mutants are switches of one build: an expression E with the mutant M becomes `(backwash_mutant_on(17) ? (M) : (E))`, a
statement (it ends with `;` or `}`) becomes `{ if (backwash_mutant_on(17)) { M } else { E } }`. Where a pattern has a part in «…», only
this part is replaced and the rest says where it is. Mutants may lie within each other.
"""
import pathlib
import re
import tomllib
import zlib
from dataclasses import dataclass, field

HERE = pathlib.Path(__file__).resolve().parent


class TableError(Exception):
    """A row that does not fit the sources, or says too little."""


@dataclass
class Mutant:
    """One row."""
    id: str
    file: str
    find: str  # with «» around the part that is replaced, if that is not all of it
    replacement: str
    promise: str  # that the mutant breaks
    tests: list[str]  # "PROGRAM FILTER", in the order in which they are tried first
    at: str = "1/1"  # which occurrence of how many

    @property
    def number(self) -> int:
        """What BACKWASH_MUTANT selects. Of the id alone, so that a new row changes no source but its own."""
        return zlib.crc32(self.id.encode()) & 0x7FFFFFFF or 1


@dataclass
class Span:
    """A stretch of a source and the mutants of exactly this stretch."""
    begin: int
    end: int
    mutants: list[Mutant] = field(default_factory=list)


def load() -> list[Mutant]:
    """All rows, in the order of the files' names and of the rows in them."""
    mutants = []
    for path in sorted(HERE.glob("*.toml")):
        for source in tomllib.loads(path.read_text())["source"]:
            for id, row in source["mutant"].items():
                mutants.append(Mutant(id, source["file"], row["find"], row["with"], row["breaks"], source["tests"], row.get("at", "1/1")))
    return mutants


def span_of(mutant: Mutant, text: str) -> Span:
    """Where the pattern lies in the source's text."""
    nth, count = (int(n) for n in mutant.at.split("/"))
    before, part, _ = re.split("[«»]", mutant.find) if "«" in mutant.find else ("", mutant.find, "")
    found = [m.start() for m in re.finditer(re.escape(re.sub("[«»]", "", mutant.find)), text)]
    if len(found) != count:
        raise TableError(f"{mutant.id}: {mutant.file} has the pattern {len(found)} times, the table says {count}: "
                         f"{mutant.find}")
    begin = found[nth - 1] + len(before)
    return Span(begin, begin + len(part), [mutant])


def spans_of(mutants: list[Mutant], text: str) -> list[Span]:
    """The mutants' places in one source, outer ones before those within them."""
    spans: dict[tuple[int, int], Span] = {}
    for mutant in mutants:
        span = span_of(mutant, text)
        spans.setdefault((span.begin, span.end), Span(span.begin, span.end)).mutants.append(mutant)
    ordered = sorted(spans.values(), key=lambda s: (s.begin, -s.end))
    for a in ordered:
        for b in ordered:
            if a.begin < b.begin < a.end < b.end:
                raise TableError(f"{a.mutants[0].id} and {b.mutants[0].id} overlap in {a.mutants[0].file}")
    return ordered


def switched(span: Span, original: str) -> str:
    """The switch between the original text and its mutants."""
    statement = original[-1] in ";}"
    for m in span.mutants:
        if statement:
            original = f"{{ if (backwash_mutant_on({m.number})) {{ {m.replacement} }} else {{ {original} }} }}"
        else:
            original = f"(backwash_mutant_on({m.number}) ? ({m.replacement}) : ({original}))"
    return original


def rewritten(mutants: list[Mutant], text: str) -> str:
    """The source with all of its mutants as switches."""
    spans = spans_of(mutants, text)

    def write(begin: int, end: int, first: int) -> tuple[str, int]:
        out, at = "", begin
        while first < len(spans) and spans[first].end <= end:
            span = spans[first]
            inner, following = write(span.begin, span.end, first + 1)
            out += text[at:span.begin] + switched(span, inner)
            at, first = span.end, following
        return out + text[at:end], first

    # C knows no other folder than the file's own.
    root = "../" * mutants[0].file.count("/") if mutants[0].file.endswith(".c") else ""
    return f'#include "{root}tests/mutants/switch.h"\n' + write(0, len(text), 0)[0]


def by_file(mutants: list[Mutant]) -> dict[str, list[Mutant]]:
    """The mutants of each source."""
    files: dict[str, list[Mutant]] = {}
    for m in mutants:
        files.setdefault(m.file, []).append(m)
    return files


def check(mutants: list[Mutant], root: pathlib.Path) -> list[str]:
    """What is wrong with the table: nothing, if it is empty."""
    wrong = []
    if not mutants:
        wrong.append("no rows were found")
    for m in mutants:
        if len(m.promise.split()) < 4:
            wrong.append(f"{m.id}: its promise is no sentence")
        if not m.tests:
            wrong.append(f"{m.id}: no test is named")
        if m.find.strip() != m.find or m.replacement == m.find:
            wrong.append(f"{m.id}: the pattern is padded or changes nothing")
    of_number: dict[int, str] = {}
    for m in mutants:
        if m.number in of_number:
            wrong.append(f"{m.id}: it is there twice, or its number is that of {of_number[m.number]}: another id, please")
        of_number[m.number] = m.id
    for name, rows in by_file(mutants).items():
        if not (root / name).is_file():
            wrong.append(f"{name}: no such file")
            continue
        text = (root / name).read_text()
        misplaced = []
        for row in rows:
            try:
                span_of(row, text)
            except TableError as error:
                misplaced.append(str(error))
        wrong += misplaced
        if not misplaced:
            try:
                spans_of(rows, text)
            except TableError as error:
                wrong.append(str(error))
    return wrong
