#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every citation of docs/ in code and documents leads somewhere: sections and equations of model.md, headings of
interfaces.md, rows of faults.md; so do relative links, and paths of documents that text names.

citations.py SOURCE_DIR [--mend]    --mend: first makes docs/… of citations without a folder; format the code after it
"""
import os
import pathlib
import re
import sys

SUFFIXES = {".cpp", ".hpp", ".c", ".h", ".md", ".sh", ".py", ".txt", ".idl", ".toml", ".in", ".cmake", ".inc", ""}
LEFT_OUT = {".git", "build", "flight", "__pycache__"}
NUMBER = r"\d\w?(?:\.\d)?"
LIST = rf"{NUMBER}(?:(?:, | and | to | or |–){NUMBER})*"


def texts(root: pathlib.Path):
    for folder, names, files in os.walk(root):
        names[:] = sorted(n for n in names if n not in LEFT_OUT)
        for name in sorted(files):
            path = pathlib.Path(folder) / name
            if path.suffix in SUFFIXES and path.stat().st_size < 1 << 20 and path.name != pathlib.Path(__file__).name:
                try:
                    yield path.relative_to(root), path.read_text()
                except UnicodeDecodeError:
                    pass


def numbers(text: str) -> list[str]:
    """1, 2 to 4 and 7 → 1 2 3 4 7."""
    found = re.findall(NUMBER, text)
    for low, high in re.findall(r"(\d+)(?: to |–)(\d+)", text):
        found += [str(n) for n in range(int(low), int(high) + 1)]
    return found


def anchor(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)).strip().lower().replace(" ", "-")


def headings(text: str) -> list[str]:
    return re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M)


def mended(text: str) -> str:
    text = re.sub(r"(?:\.\./)*\bshared/(model|interfaces|faults)\.md", r"docs/\1.md", text)
    return re.sub(r"(?<![\w./-])(?<!\]\()(model|interfaces|faults)\.md", r"docs/\1.md", text)


def mend(root: pathlib.Path) -> None:
    for path, text in texts(root):
        if path.parts[0] != "docs" and path.parts[:2] != ("tests", "docs") and mended(text) != text:
            (root / path).write_text(mended(text))
            print(f"mended {path}")


def main() -> int:
    root = pathlib.Path(sys.argv[1]).resolve()
    if "--mend" in sys.argv:
        mend(root)
    model, faults = (root / "docs/model.md").read_text(), (root / "docs/faults.md").read_text()
    sections = set(re.findall(rf"^#+ ({NUMBER})\.? ", model, re.M)) | {
        s.rstrip(".") for s in re.findall(rf"^#+ ({NUMBER}\.?) ", model, re.M)}
    equations = set(re.findall(rf"^(?:\*\*| {{4,}})({NUMBER}-\d+)\s", model, re.M))
    rows = set(re.findall(r"^\| (\d+) \|", faults, re.M))
    interfaces = set(headings((root / "docs/interfaces.md").read_text()))
    wrong, seen = [], 0

    for path, text in texts(root):
        # A citation may be broken by a comment's end of line.
        joined = re.sub(r"[ \t]*\n[ \t]*(?:///?|#|\*)?[ \t]*", " ", text)
        for match in re.finditer(r"([\w./-]*)\b(model|interfaces|faults)\.md(?=(.{0,90}))", joined):
            prefix, page, after = match.groups()
            if not prefix and path.parent == pathlib.Path("docs"):
                pass
            elif prefix != "docs/" and not prefix.endswith("../docs/"):
                wrong.append(f"{path}: cites {prefix}{page}.md, which is docs/{page}.md")
                continue
            seen += 1
            after = after.lstrip(")`")
            if page == "model" and (cited := re.match(rf",? (?:sections? )?({NUMBER}-\d+)", after)):
                if cited[1] not in equations:
                    wrong.append(f"{path}: model.md has no equation {cited[1]}")
            elif page == "model" and (cited := re.match(rf",? (?:sections? )?({LIST})\b", after)):
                wrong += [f"{path}: model.md has no section {n}" for n in numbers(cited[1]) if n not in sections]
            elif page == "faults" and (cited := re.match(rf",? rows? ({LIST})\b", after)):
                wrong += [f"{path}: faults.md has no row {n}" for n in numbers(cited[1]) if n not in rows]
            elif page == "interfaces" and (cited := re.match(r', "([^"]+)"', after)):
                if cited[1] not in interfaces:
                    wrong.append(f"{path}: interfaces.md has no heading '{cited[1]}'")
        for name in re.findall(r"(?<![\w./-])(?:core|docs|firmware_bridge|services|tests)/[\w./-]+\.md\b", joined):
            if not (root / name).is_file():
                wrong.append(f"{path}: there is no {name}")
        if found := re.search(r"shared/\w+\.md", joined):
            wrong.append(f"{path}: cites {found[0]}, which a clone does not have")
        if path.suffix != ".md":
            continue
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"\w+:", target):
                continue
            file, _, fragment = target.partition("#")
            linked = root / path.parent / file if file else root / path
            if not linked.exists():
                wrong.append(f"{path}: the link {target} leads nowhere")
            elif fragment and fragment not in map(anchor, headings(linked.read_text())):
                wrong.append(f"{path}: the link {target} leads to no heading")
    if seen < 100:
        wrong.append(f"only {seen} citations were found")
    for line in dict.fromkeys(wrong):
        print(line)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
