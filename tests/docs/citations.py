#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every citation of docs/ in code, scripts and documents leads somewhere: sections and equations of model.md, headings of
interfaces.md, named parts of model.md ("section 4, "Centre""), rows of faults.md, in either order ("row 3 of docs/faults.md"); bare rows in comments and documents, bare
sections and equations in docs/; so do relative links, headings quoted after them, and paths of files that text names.

citations.py SOURCE_DIR [--mend]    --mend: first makes docs/… of citations without a folder; format the code after it
"""
import os
import pathlib
import re
import sys

SUFFIXES = {".cpp", ".hpp", ".c", ".h", ".md", ".sh", ".py", ".txt", ".idl", ".toml", ".in", ".cmake", ".inc",
            ".yml", ".yaml", ".cff", ".service", ".json", ".svg", ".html", ""}
PLANTED = {pathlib.Path(__file__).name, "planted.py"}  # what these name is no citation
LEFT_OUT = {".git", "build", "flight", "__pycache__"}
NUMBER = r"\d\w?(?:\.\d)?"
LIST = rf"{NUMBER}(?:(?:, and |, | and | to | or |–){NUMBER})*"
EQUATION = r"(?<![\w.^_-])\d[a-d]?(?:\.\d)?-\d+(?![\w-])"
NAMED = re.compile(r"(?<![\w./$}*<-])(?:core|docs|firmware_bridge|services|tests|idl|systemd|toolchains)/[\w./-]+\."
                   r"(?:md|cpp|hpp|c|h|py|sh|toml|idl|cmake|cff|svg|png)\b(?!\.\w|\*)")


def texts(root: pathlib.Path):
    for folder, names, files in os.walk(root):
        names[:] = sorted(n for n in names if n not in LEFT_OUT)
        for name in sorted(files):
            path = pathlib.Path(folder) / name
            if path.suffix in SUFFIXES and path.stat().st_size < 1 << 20 and path.name not in PLANTED:
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


def parts_of(model: str) -> dict[str, list[str]]:
    """Section of model.md → what its headings and bold text call its parts: "1-4 Visible." is "Visible"."""
    parts = re.split(rf"^#+ ({NUMBER})\.? (.*)$", model, flags=re.M)
    return {section: [heading] + [re.sub(rf"^{NUMBER}-\d+ |\.$", "", bold) for bold in re.findall(r"\*\*([^*]+)\*\*", text)]
            for section, heading, text in zip(parts[1::3], parts[2::3], parts[3::3])}


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
    parts = parts_of(model)
    interfaces = set(headings((root / "docs/interfaces.md").read_text()))
    wrong, seen = [], 0

    def rows_in(path, text):
        # Row 0 is the first of a table or a matrix, not a fault.
        for list_ in re.findall(rf"\b[Rr]ows? ({LIST})\b(?! of (?!docs/faults))", text):
            wrong.extend(f"{path}: faults.md has no row {n}" for n in numbers(list_) if n not in rows | {"0"})

    def sections_in(path, text):
        for list_ in re.findall(rf"\b[Ss]ections? ({LIST})\b", text):
            wrong.extend(f"{path}: model.md has no section {n}" for n in numbers(list_) if n not in sections)

    def equations_in(path, text):
        wrong.extend(f"{path}: model.md has no equation {n}" for n in re.findall(EQUATION, text) if n not in equations)

    for path, text in texts(root):
        # A citation may be broken by a comment's end of line.
        joined = re.sub(r"[ \t]*\n[ \t]*(?:///?|#|\*)?[ \t]*", " ", text)
        for match in re.finditer(r"([\w./-]*)\b(model|interfaces|faults)\.md(?=(.{0,200}))", joined):
            prefix, page, after = match.groups()
            if not prefix and path.parent == pathlib.Path("docs"):
                pass
            elif prefix != "docs/" and not prefix.endswith("../docs/"):
                wrong.append(f"{path}: cites {prefix}{page}.md, which is docs/{page}.md")
                continue
            seen += 1
            after = re.sub(r"^\]\([^)]*\)", "", after).lstrip(")`")
            after = re.sub(r"^[,:]? ?\(?(?=rows? |sections? |equations? )|^#(row|section)-", lambda m: ", " + (f"{m[1]} " if m[1] else ""), after)
            before = joined[max(0, match.start() - 60):match.start()]
            if page == "model" and (cited := re.search(rf"\b[Ss]ections? ({LIST}) (?:of|in) [(`[]*$", before)):
                sections_in(path, f"section {cited[1]}")
            if page == "model" and (cited := re.match(rf"(?:, )?(?:sections? {LIST})?[ ,(]*(?:equations? )?({EQUATION}(?:(?:, | and | to ){EQUATION})*)", after)):
                equations_in(path, cited[1])
            if page == "model" and (cited := re.match(rf',? section ({NUMBER}),? \(?"([^"]+)"', after)):
                if cited[2] not in parts.get(cited[1], []):
                    wrong.append(f"{path}: section {cited[1]} of model.md has no '{cited[2]}'")
            if page == "interfaces" and re.match(r",? sections? \d", after):
                wrong.append(f"{path}: interfaces.md has headings, no numbered sections")
            if page == "model" and (cited := re.match(rf",? (?:sections? )?({NUMBER}-\d+)", after)):
                if cited[1] not in equations:
                    wrong.append(f"{path}: model.md has no equation {cited[1]}")
            elif page == "model" and (cited := re.match(rf",? (?:sections? )?({LIST})\b", after)):
                wrong += [f"{path}: model.md has no section {n}" for n in numbers(cited[1]) if n not in sections]
            elif page == "faults" and (cited := re.match(rf",? rows? ({LIST})\b", after)):
                wrong += [f"{path}: faults.md has no row {n}" for n in numbers(cited[1]) if n not in rows]
            elif page == "interfaces" and (cited := re.match(r',? \(?"([^"]+)"', after)):
                if cited[1] not in interfaces:
                    wrong.append(f"{path}: interfaces.md has no heading '{cited[1]}'")
        if path.suffix in {".cpp", ".hpp", ".c", ".h", ".idl"}:
            comments = re.sub(r"\n[ \t]*///?<?", " ", "".join(re.findall(r"//[^\n]*\n(?=[ \t]*//)|//[^\n]*", text)))
            comments += re.sub(r"\s*\n[ \t]*\*?[ \t]*", " ", "".join(re.findall(r"/\*.*?\*/", text, re.S)))
            rows_in(path, comments)
            if found := re.findall(rf"\b(?:[Ee]quations?|Eqs?\.) \(?({EQUATION})", comments):
                equations_in(path, " ".join(found))
        elif path.suffix == ".md":
            rows_in(path, joined)
        elif path.suffix in {".sh", ".toml", ".cmake", ".yml", ".yaml", ".txt"}:
            rows_in(path, " ".join(re.findall(r"#[^\n]*", text)))
        elif path.suffix == ".py" and path.parts[:2] != ("tests", "docs"):
            rows_in(path, " ".join(re.findall(r"#[^\n]*", text) + [" ".join(d.split()) for d in re.findall(r'""".*?"""', text, re.S)]))
        if path.parent == pathlib.Path("docs") and path.suffix == ".md":
            sections_in(path, joined)
        if path == pathlib.Path("docs/model.md"):
            equations_in(path, re.sub(r"`[^`]*`", "", text))
        if path == pathlib.Path("docs/faults.md"):
            wrong += [f"{path}: there is no row {n}" for n in re.findall(r"\bas (\d+)\b", text) if n not in rows]
        for name in NAMED.findall(joined):
            if "NAME" not in name and not (root / name).is_file():
                wrong.append(f"{path}: there is no {name}")
        for page, heading in re.findall(r'(?<![\w./-])((?:core|docs|firmware_bridge|services|tests)/[\w./-]+\.md)`?,? "([^"]+)"', joined):
            if (root / page).is_file() and heading not in headings((root / page).read_text()):
                wrong.append(f"{path}: {page} has no heading '{heading}'")
        if found := re.search(r"shared/\w+\.md", joined):
            wrong.append(f"{path}: cites {found[0]}, which a clone does not have")
        if path.suffix != ".md":
            continue
        for target, heading in re.findall(r'\]\(([^)#]+\.md)\),? "([^"]+)"', joined):
            if (root / path.parent / target).is_file() and heading not in headings((root / path.parent / target).read_text()):
                wrong.append(f"{path}: {target} has no heading '{heading}'")
        linked_to = re.findall(r"\]\(([^)\s<]+)(?: \"[^\"]*\")?\)|\]\(<([^>]+)>\)|^\[[^\]^]+\]: (\S+)|(?:src|href)=\"([^\"]+)\"", text, re.M)
        for target in ("".join(found) for found in linked_to):
            if re.match(r"\w+:", target):
                continue
            file, _, fragment = target.partition("#")
            linked = root / path.parent / file if file else root / path
            if not linked.resolve().is_relative_to(root):
                wrong.append(f"{path}: the link {target} leaves the clone")
            elif not linked.exists():
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
