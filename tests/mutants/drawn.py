# SPDX-License-Identifier: BSD-3-Clause
"""Mutants that nobody chose: operators of the same sources, drawn at random.

A comparison gets another comparison, && and || change places, and so do + and −, * and /. What is switched is the whole
operation with its operands, from the bracket or the weaker operator on its left to that on its right.
"""
import collections
import json
import pathlib
import random
import re
import subprocess

import table

COMPARISONS = ["<", "<=", ">", ">=", "==", "!="]
OTHERS = {"&&": ["||"], "||": ["&&"], "+": ["-"], "-": ["+"], "*": ["/"], "/": ["*"],
          **{c: [d for d in COMPARISONS if d != c] for c in COMPARISONS}}
# How strongly each binds its operands; those that are not in OTHERS only end an operation.
STRENGTH = {"||": 1, "&&": 2, "|": 2.3, "&": 2.6, **dict.fromkeys(COMPARISONS, 3), "<<": 3.5, ">>": 3.5,
            "+": 4, "-": 4, "*": 5, "/": 5, "%": 5}
TOKEN = re.compile(r" (\|\||&&|<=|>=|==|!=|<|>|\+|-|\*|/|\?|:|=|\+=|-=|\*=|/=|<<|>>|%|&|\|) |[()\[\]{},;]|\breturn\b")


def code_only(text: str) -> str:
    """The text with comments and strings blanked, of the same length."""
    def blank(match: re.Match) -> str:
        return re.sub(r"[^\n]", "_" if match[0][0] in "\"'" else " ", match[0])

    return re.sub(r"//[^\n]*|/\*.*?\*/|^#[^\n]*|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'", blank, text,
                  flags=re.DOTALL | re.MULTILINE)


def operand_end(tokens: list[re.Match], first: int, step: int, strength: int) -> int | None:
    """Where an operation ends, going from its operator to the left or to the right."""
    opening, closing = ("([{", ")]}") if step > 0 else (")]}", "([{")
    depth = 0
    for token in tokens[first + step::step]:
        text = token[0].strip()
        if text in opening:
            depth += 1
        elif text in closing:
            if depth == 0:
                return token.start() if step > 0 else token.end()
            depth -= 1
        elif depth == 0 and STRENGTH.get(text, 0) < strength + (step > 0):
            return token.start() if step > 0 else token.end()
    return None


def candidates(text: str) -> list[tuple[int, int, int, str]]:
    """Each operator that can be switched: begin and end of its operation, its own place, what it is."""
    code = code_only(text)
    tokens = list(TOKEN.finditer(code))
    found = []
    for n, token in enumerate(tokens):
        operator = token[0].strip()
        if operator not in OTHERS:
            continue
        begin, end = (operand_end(tokens, n, step, STRENGTH[operator]) for step in (-1, 1))
        if begin is None or end is None:
            continue
        begin += len(code[begin:]) - len(code[begin:].lstrip())
        end = begin + len(code[begin:end].rstrip())
        if begin < token.start() < end and "\n" not in code[begin:end]:
            found.append((begin, end, token.start(1), operator))
    return found


def row(file: str, text: str, candidate: tuple[int, int, int, str], generator: random.Random) -> table.Mutant:
    """One candidate as a row of the table."""
    begin, end, at, operator = candidate
    other = generator.choice(OTHERS[operator])
    line, find = line_of(text, at), text[begin:end]
    before = [m.start() for m in re.finditer(re.escape(find), text)]
    left, right = text[begin:at].strip(), text[at + len(operator):end].strip()
    return table.Mutant(id=f"drawn-{pathlib.PurePath(file).stem}-{line}-{at}", file=file, find=find,
                        replacement=f"({left}) {other} ({right})", at=f"{before.index(begin) + 1}/{len(before)}",
                        promise=f"none: in line {line} {operator} becomes {other}: {find}", tests=[])


def line_of(text: str, at: int) -> int:
    """Number of the line, from 1."""
    return text.count("\n", 0, at) + 1


def draw(root: pathlib.Path, files: set[str], generator: random.Random) -> list[table.Mutant]:
    """Every operator that can be switched once, in an order that was drawn, none across another."""
    texts = {file: (root / file).read_text() for file in sorted(files)}
    everywhere = [(file, c) for file, text in texts.items() for c in candidates(text)]
    generator.shuffle(everywhere)
    taken: dict[str, list[tuple[int, int]]] = collections.defaultdict(list)
    rows = []
    for file, c in everywhere:
        if any(a < c[1] and c[0] < b for a, b in taken[file]):
            continue
        taken[file].append(c[:2])
        rows.append(row(file, texts[file], c, generator))
    return rows


def refused_lines(tree: pathlib.Path, file: str) -> set[int]:
    """Lines of the source that the compiler refuses once they are switched: no numbers, or in a constant."""
    listed = subprocess.run(["ninja", "-C", str(tree / "build" / "release"), "-t", "compdb"], check=True,
                            capture_output=True, text=True).stdout
    command = next(c["command"] for c in json.loads(listed) if c["file"].endswith("/" + file))
    command = re.sub(r"^\S*ccache ", "", command)
    command = re.sub(r" -o \S+| -MD| -MT \S+| -MF \S+", "", command) + " -fsyntax-only -fmax-errors=0"
    said = subprocess.run(command, shell=True, cwd=tree / "build" / "release", capture_output=True, text=True)
    if said.returncode == 0:
        return set()
    return {int(n) - 1 for n in re.findall(re.escape(file) + r":(\d+):", said.stderr)}
