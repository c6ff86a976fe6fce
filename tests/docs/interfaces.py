#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/interfaces.md says what the programs are.

interfaces.py SOURCE_DIR BUILD_DIR [--update]

What stands between `<!-- printed: NAME -->` and `<!-- end -->` is printed, by --update into the page, from where it is declared: keys of files from
core/config (the program tables), options from --help, topics with type, direction and delivery from services. The rest is written by hand, and
compared: JSON names, exit codes, columns of CSV, commands, MAVLink messages.
"""
import pathlib
import re
import subprocess
import sys

from page import expect, quoted, rows, sections, wrong

# --- printed ---------------------------------------------------------------------------------------------------------

EVERYWHERE = ("-h,--help", "--version", "--json", "--force", "--quiet", "--threads")  # the page's conventions have them


# Of these a name says all: the page's conventions tell what the files are.
PLAIN = ("OctoMap file or builtin:NAME", "model file or builtin:NAME", "vehicle file or builtin:NAME", "HTML page to write")


def options(help_text: str) -> dict[str, str]:
    """Arguments and options of a --help: name with its values and default, and what it is. Those of one meaning stand together."""
    text = re.sub(r"\n {20,}(?=\S)", "  ", help_text).split("Subcommands:")[0]  # a name may be too long for its column
    text = re.sub(r"(?s)(Options:.*?)\nExample.*", r"\1", text)
    text = re.sub(r"=\[([^]]*)\] \.\.\.(?: (?=\S))?", r"=\1  ", text)  # of several values
    told: dict[str, str] = {}
    for name, spec, meaning in re.findall(r"^  ((?:-\w,)?-{0,2}[\w-]+)(?: (\S.*?))?(?: {2,}(.*))?$", text, re.M):
        if name in EVERYWHERE or name.startswith("backwash"):
            continue
        kind, _, default = re.sub(r"\S+@\S+", "user@host", spec).removesuffix(" REQUIRED").partition("=")
        kind = re.sub(r"^(TEXT|FLOAT|INT|UINT)\b(?: x \d| \.\.\.)?:?| ?Excludes:.*|[{}]", "", kind).replace("NONNEGATIVE", "0 or more").replace("POSITIVE", "above 0")
        kind = kind.lower() if "," in kind else kind
        notes = [kind.strip(), "needed" if spec.endswith("REQUIRED") else "", f"default {default.strip()}" if default.strip() else ""]
        cell = f"`{name.split(',')[-1]}`" + (f" ({'; '.join(filter(None, notes))})" if any(notes) else "")
        meaning = "" if meaning in PLAIN else meaning
        told[meaning] = f"{told[meaning]}, {cell}" if meaning in told else cell
    return told


def listed_keys(table: str) -> str:
    """Rows of a table of keys as a list: key (unit, range, default): meaning. *How to measure it.* What differs by its axis alone stands with its key."""
    lines: list[str] = []
    for key, unit, span, default, meaning, how in rows(table):
        brackets = ", ".join(filter(None, (unit, span, default)))
        if (lines and len(meaning.split()) <= 3 and f"({brackets}):" in lines[-1] and lines[-1].startswith(f"- {key.split('.')[0]}.")
                and (how in ("", "the same") or f"*{how}*" in lines[-1])):
            lines[-1] = lines[-1].replace(" (", f", {meaning} {key} (", 1)
            continue
        lines.append(f"- {key}" + (f" ({brackets})" if brackets else "") + f": {meaning}" + (f". *{how}*" if how else ""))
    return "\n".join(lines).replace("\\|", "|") + "\n"


def listed(told: dict[str, str]) -> str:
    return "".join(f"- {cell}: {meaning}\n" if meaning else f"- {cell}\n" for meaning, cell in told.items())


def help_of(*command: str) -> str:
    return subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout


def verbs_of(text: str) -> list[tuple[str, str]]:
    return re.findall(r"^  (\w+) {2,}(.*)", text.split("Subcommands:")[1], re.M) if "Subcommands:" in text else []


def declared(build: pathlib.Path) -> dict[str, str]:
    """Rows of the tables that core declares, by name."""
    run = subprocess.run([build / "tests/tables"], capture_output=True, text=True, check=True).stdout
    parts = re.split(r"^== (.*)\n", re.sub(r"docs/(\w+\.md)", r"[\1](\1)", run), flags=re.M)[1:]
    return dict(zip(parts[::2], parts[1::2]))


def printed(root: pathlib.Path, build: pathlib.Path) -> dict[str, str]:
    """Every block by its name."""
    tables = declared(build)
    blocks = {name: listed_keys(table) for name, table in tables.items() if name != "profiles"}
    blocks["profiles"] = "| profile | header.frame_id | child_frame_id | twist | rate_least, Hz |\n| --- | --- | --- | --- | --- |\n" + tables["profiles"]

    def about(path: str, verb: str, what: str) -> str:
        text = help_of(path, *verb.split())
        of_inner = {(v, w): options(help_of(path, verb, v)) for v, w in verbs_of(text)}
        shared = {item for told in of_inner.values() for item in told.items() if sum(item in o.items() for o in of_inner.values()) > 1}
        out = f"{what}.\n\n{listed(options(text) or dict(sorted(shared)))}"
        for (v, w), told in of_inner.items():
            takes = "".join(f", {cell.split(' ')[0]}" for item in told.items() if item in shared for cell in [item[1]])
            out += f"\n`{pathlib.Path(path).name} {verb} {v}`{takes}: {w}.\n\n{listed(dict(i for i in told.items() if i not in shared))}"
        return re.sub(r"\n{3,}", "\n\n", out).rstrip("\n") + "\n"

    seen: dict[str, str] = {}  # a meaning of many words → the verb behind which it stands

    def once(verb: str, block: str) -> str:
        def entry(line: re.Match) -> str:
            if len(line[2].split()) < 6 or seen.setdefault(line[2], verb) == verb:
                return line[0]
            return f"{line[1]}: as of `{seen[line[2]]}`"
        return re.sub(r"^(- `[^:]*(?:\(.*?\))?): (.*)$", entry, block, flags=re.M)

    for program in ("backwash", "backwashd", "backwash-bench"):
        path = str(build / "services" / program)
        text = help_of(path)
        blocks |= {f"{program} {verb}": once(verb, about(path, verb, what)) for verb, what in verbs_of(text)} or {program: listed(options(text))}
    path, verbs, of_verbs = str(build / "services/backwashctl"), "", ""
    for verb, what in verbs_of(help_of(path)):
        told = options(help_of(path, verb))
        verbs += f"- `{verb}`{' `--wait`' if told.pop('return when it is done', '') else ''}: {what}\n"
        of_verbs += listed({m: cell.replace("`", f"`{verb} ", 1) for m, cell in told.items()})
    blocks["backwashctl"] = f"{listed(options(help_of(path)))}\nVerbs; `--wait` returns when it is done:\n\n{verbs}\nOptions of one verb:\n\n{of_verbs}"
    all_topics = topics_of(root)
    more = {"vehicle": ["rt/diagnostics", "rt/tf"]}  # of all robots of a domain
    blocks["roles"] = "".join(f"- `{role}` may write " + (", ".join([n for n, _, _, may in all_topics if role in may] + more.get(role, [])) or "nothing") + "\n"
                              for role in ("vehicle", "station", "vio", "observer"))
    blocks["DDS"] = topics(root)
    return blocks


BLOCK = re.compile(r"(<!-- printed: (.*?) -->\n)(.*?)(<!-- end -->)", re.S)


# --- JSON and exit codes ---------------------------------------------------------------------------------------------

def names_of_json(text: str) -> set[str]:
    text = re.sub(r"one_of\(\{.*?\}\)", "", text)  # values of an option
    return set(re.findall(r'\{"([A-Za-z]\w*)",(?! *&)', text)) | set(re.findall(r'(?<=[\w\]])\["([A-Za-z]\w*)"\]', text))


def names_of_status(root: pathlib.Path) -> set[str]:
    """Keys of the status: the list that every output goes through, and the parameters. It has each member of the IDL."""
    idl = re.search(r"struct Status_ \{(.*?)\};", re.sub(r"//[^\n]*", "", (root / "idl/backwash_msgs.idl").read_text()), re.S)[1]
    listed = re.findall(r'StatusMember\{"(\w+)",\s*&Status::(\w+)', (root / "services/dds/status_members.hpp").read_text())
    expect("members of the status", {member for _, member in listed} | {"stamp", "session", "sequence_number", "parameters", "advice"},
           set(re.findall(r"(\w+);", idl)))
    return {key for key, _ in listed} | {"parameters"}


def check_json(root: pathlib.Path, text: str, sections_of: dict[str, str]) -> None:
    # Every name that the programs write is somewhere in the page; every name in a JSON table is written somewhere.
    named = {part for q in quoted(text) for part in re.findall(r"[A-Za-z_]\w*", q)}
    files = [*(root / "services/backwash").rglob("*.cpp"),
             *(root / name for name in ("research/compare/compare_output.cpp", "research/compare/compare_rows.cpp",
                                        "research/feasibility/feasibility.cpp",
                                        "services/backwashctl/status_output.cpp", "services/backwashctl/verbs.cpp"))]
    not_output = {"flight_spec.cpp", "import.cpp", "main.cpp", "story_page.cpp"}
    written = set()
    for file in files:
        code = file.read_text()
        written |= names_of_json(code)
        if file.name not in not_output:
            input_names = set(re.findall(r'\(\*table\)\["(\w+)"\]', code))  # of TOML that is read
            wrong.extend(f"JSON of {file.name}: not documented: {x}"
                         for x in sorted(names_of_json(code) - input_names - named))
    written |= names_of_status(root)
    for measures in (root / "research/compare").glob("compare*.cpp"):  # names of Measure
        written |= set(re.findall(r'"([a-z]\w*)"', measures.read_text()))
    for heading, section in sections_of.items():
        for part in re.split(r"\n\n", section):
            if not part.lstrip().startswith("JSON"):
                continue
            for name in (q for line in part.splitlines()[1:] for q in quoted(line.split(":")[0])):
                wrong.extend(f"{heading}: no JSON is called {x}" for x in re.findall(r"\w+", name) if x not in written)


def check_exit_codes(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    documented = {int(c[0]) for c in rows(sections_of["Exit codes"]) if c[0].isdigit()}
    actual = {0, 1}
    for file in (root / "services").rglob("*.[ch]pp"):
        for line in re.findall(r"constexpr int (k\w+ = \d+(?:, k\w+ = \d+)*);", file.read_text()):
            actual |= {int(n) for n in re.findall(r"= (6[4-9]|7[0-8])\b", line)}
        for body in re.findall(r"enum (?:class )?\w*Exit\w*[^{]*\{(.*?)\}", file.read_text(), re.S):
            actual |= {int(n) for n in re.findall(r"= (\d+)", body)}
    stalls = (root / "services/bench/stalls.sh").read_text()
    actual |= {int(n) for n in re.findall(r"^readonly .*says_nothing=(\d+)", stalls, re.M)}
    expect("exit codes", documented, actual)


# --- tables ----------------------------------------------------------------------------------------------------------

def check_columns(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    """Columns of the flight log. Of a series the first one is documented: x for x, y and z, 1 for 1 to 4."""
    code = (root / "core/log/columns/column_units.cpp").read_text().split("kinds() {")[1].split("return all;")[0]
    actual = set(re.findall(r'"(\w+)"', code))
    shown = {q for c in rows(sections_of["Flight log, CSV"])[1:] for q in quoted(c[0])}
    in_words = set(re.findall(r"\w+", " ".join(quoted(sections_of["Column map"]))))  # what only a foreign table has

    def first(column: str) -> str:
        return re.sub(r"^(rpm|motor)[2-4]$", r"\g<1>1", re.sub(r"^((?:cmd_)?[va]?|specific_force_)[yz](?=_m|$)", r"\1x", column))

    wrong.extend(f"Flight log, CSV: not documented: {c}" for c in sorted(actual) if not {c, first(c)} & (shown | in_words))
    wrong.extend(f"Flight log, CSV: does not exist: {c}" for c in sorted(shown - actual))
    if len(actual) < 30:
        wrong.append(f"Flight log, CSV: only {len(actual)} columns were found in core/log/columns/column_units.cpp")


def check_tables(root: pathlib.Path, text: str) -> None:
    """The columns of every table that a program writes are somewhere in the page, as the code's first line names them."""
    named = {part for q in quoted(text) for part in re.findall(r"\w+", q)}
    found = 0
    for file in sorted([*(root / "services").rglob("*.[ch]pp"), *(root / "core/config").rglob("*.[ch]pp")]):
        code = re.sub(r'"\s*"', "", file.read_text())  # one text over several lines
        for line in re.findall(r'"(\w+(?:,\w+){3,})(?:\\n|")', code):
            found += 1
            columns = {re.sub(r"^(.*_|[va]?)[yz](?=_m|$)", r"\1x", c) if c not in named else c for c in line.split(",")}
            wrong.extend(f"{file.relative_to(root)}: the column {c} is not documented" for c in sorted(columns - named))
    if found < 3:
        wrong.append(f"only {found} tables were found in services and core/config")


# --- DDS and MAVLink -------------------------------------------------------------------------------------------------

DELIVERY = {"latest": "best effort, keep last 1", "scans": "best effort, keep last 8", "status": "reliable, keep last 1",
            "parts": "best effort, keep last 64", "reliable": "reliable, keep last 64",
            "state": "reliable, transient local, keep last 1"}


def topics_of(root: pathlib.Path) -> list[tuple[str, str, str, list[str]]]:
    """Name, type, delivery and the roles that may write it, of each topic of idl/topics.hpp."""
    types = re.findall(r'Typed<(\w+)_desc, topic_named\("(\w+)"\)>', (root / "services/dds/topics.hpp").read_text())
    type_of = {name: type_.replace("_msg_dds__", "::msg::dds_::") for type_, name in types}
    code = (root / "idl/topics.hpp").read_text()
    return [(name, type_of[name], DELIVERY[delivery], re.findall(r"vehicle|station|vio", may.lower()))
            for name, delivery, may in re.findall(r'\{"(\w+)", Delivery::(\w+), (.+)\},', code)]


def topics(root: pathlib.Path) -> str:
    """The topics by their declarations; what is in one stands behind it in the page."""
    said = {c[0].rsplit("/", 1)[1]: c[4] for c in rows(sections((root / "docs/interfaces.md").read_text())["DDS"]) if c[0].startswith("rt/NAMESPACE")}
    out = "| topic | type | direction | delivery | frame and content |\n| --- | --- | --- | --- | --- |\n"
    for name, type_, delivery, may in topics_of(root):
        if not said.get(name):
            wrong.append(f"DDS: what is in {name}?")
        out += f"| rt/NAMESPACE/{name} | {type_} | {'out' if 'vehicle' in may else 'in'} | {delivery} | {said.get(name, '')} |\n"
    return out


def check_dds(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    idl = (root / "idl/backwash_msgs.idl").read_text()
    for prefix in ("COMMAND_", "ACK_"):
        cells = [c[0] for c in rows(sections_of["Commands"])]
        expect(f"{prefix}…", {w for c in cells for w in re.findall(rf"{prefix}\w+", c)},
               set(re.findall(rf"const octet ({prefix}\w+)", idl)))
    status = {q for line in sections_of["JSON of status"].splitlines() for q in quoted(line.split(":")[0])}
    expect("JSON of status", status, names_of_status(root))


def check_mavlink(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    actual = set()
    for file in (root / "firmware_bridge/mavlink").glob("*.hpp"):
        actual |= set(re.findall(r'kName = "([A-Z0-9_]+)"', file.read_text()))
    section = sections_of["MAVLink"]
    cells = " ".join(c[0] for c in rows(section))
    words = set(re.findall(r"\b[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*\b", cells + section.split("The codec knows more")[1].split("\n\n")[0]))
    expect("MAVLink messages", words, actual)


# --- the daemon's example --------------------------------------------------------------------------------------------

def example(text: str, table: str) -> str:
    """The example with what the table says behind each key; keys that it lacks stand at their table's end as comments."""
    keys = {quoted(c[0])[0]: c for c in rows(table)}
    out: list[str] = []
    seen, section = set(), ""

    def line(beginning: str, key: str) -> str:
        cells = keys[key]
        seen.add(key)
        words = re.sub(r"\[(\w+\.md)\]\(.*?\)", r"docs/\1", f"{cells[1]}: {cells[4]}" if cells[1] else cells[4])
        words = re.sub(r"\[(.*?)\]\(#.*?\)", lambda m: "docs/interfaces.md" + f', "{m[1]}"', words).replace("`", "")
        return f"{beginning:<30} # {words}"

    def rest() -> list[str]:
        missing = [k for k in keys if k not in seen and k.rpartition(".")[0] == section]
        return [line(f"# {k.rpartition('.')[2]} = {cells[3] if re.fullmatch(r'[-.0-9]+|true|false', (cells := keys[k])[3]) else chr(34) * 2}", k) for k in missing]

    for old in text.splitlines():
        if table_of := re.match(r"(?:# )?\[([\w.]+)\]", old):
            at = len(out) - (not out[-1])
            out[at:at] = rest()
            section = table_of[1]
        found = re.match(r'((?:# )?(\w+) = (?:"[^"]*"|[^#" ]+))(?= *(?:#|$))', old)
        key = found and ".".join(filter(None, (section, found[2])))
        if re.match(r" +#", old):
            continue
        out.append(line(found[1], key) if key in keys else old)
    return "\n".join(out + rest()) + "\n"


def main() -> int:
    root, build = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    page = root / "docs/interfaces.md"
    text = page.read_text()
    blocks = printed(root, build)
    shipped = root / "core/config/files/backwashd.daemon.toml"
    expect("printed block", {m[1] for m in BLOCK.findall(text)}, set(blocks))
    for file, whole in ((page, BLOCK.sub(lambda m: m[1] + blocks.get(m[2], m[3]) + m[4], text)), (shipped, example(shipped.read_text(), declared(build)["Daemon file"]))):
        if "--update" in sys.argv:
            file.write_text(whole)
        elif whole != file.read_text():
            wrong.append(f"{file.name} is not what the source says; mend by: tests/docs/interfaces.py {root} {build} --update")
    text = page.read_text()
    sections_of = sections(text)
    spec = re.search(r'only\(path, file, \{([^}]*)\}', (root / "services/backwash/fly/flight_spec.cpp").read_text())[1]
    expect("Flight specification", {quoted(c[0])[0] for c in rows(sections_of["Flight specification"])[1:]}, set(re.findall(r'"(\w+)"', spec)))
    check_json(root, text, sections_of)
    check_exit_codes(root, sections_of)
    check_columns(root, sections_of)
    check_tables(root, text)
    check_dds(root, sections_of)
    check_mavlink(root, sections_of)
    for line in wrong:
        print(f"docs/interfaces.md: {line}")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
