#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""docs/interfaces.md says what the programs are: nothing is missing from it and nothing in it is made up.

interfaces.py SOURCE_DIR BUILD_DIR

Keys of the files, as the programs tell them, with range and presence by the strict tables of core/config; verbs and options by --help, names of JSON, exit codes,
columns of the flight log, topics with type and delivery, verbs and results of commands, MAVLink messages.
"""
import pathlib
import re
import subprocess
import sys

from configuration import check_keys
from page import expect, quoted, rows, sections, wrong

# --- programs --------------------------------------------------------------------------------------------------------

def help_of(*command: str) -> tuple[set[str], set[str]]:
    """Verbs and options of a program, by its --help."""
    text = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout
    verbs = re.findall(r"^  (\w+) {2,}", text.split("Subcommands:")[1], re.M) if "Subcommands:" in text else []
    options = {o for line in re.findall(r"^  (-\S+)", text, re.M) for o in line.split(",")}
    return set(verbs), options - {"-h", "--help", "--version"}


def defaults_of(*command: str) -> list[tuple[str, str]]:
    """Options with a default, and its first word, by --help; what differs from machine to machine is left out."""
    text = subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"^  (?:-\w,)?(--[\w-]+) +[A-Z][A-Z, ]*(?:x \d+)?(?::\S+(?: in \[[^\]]*\])?)?=(\S+)", text, re.M)
    return [(option, default.strip("[]").split(",")[0]) for option, default in found if option != "--station"]


def check_defaults(where: str, command: list[str], cells: list[str]) -> None:
    """Each default of --help stands in the line that documents its option."""
    for option, default in defaults_of(*command):
        if not any(option in options_in(c) and re.search(rf"(?<![\w.]){re.escape(default)}(?![\w])", c) for c in cells):
            wrong.append(f"{where}: {option} has the default {default}, which is not documented")


def options_in(text: str) -> set[str]:
    return {o for q in quoted(text) for o in re.findall(r"(?<![\w-])--?[a-z][a-z-]*", q)}


def check_programs(root: pathlib.Path, build: pathlib.Path, sections_of: dict[str, str]) -> None:
    services = build / "services"
    usage = subprocess.run(["bash", str(root / "fly"), "--help"], capture_output=True, text=True, check=True).stdout
    expect("fly", options_in(sections_of["fly"]), set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", usage)))
    verbs, _ = help_of(str(services / "backwash"))
    every = options_in(sections_of["backwash"].split("\n|")[0].split(".")[0])
    expect("verbs of backwash", {h.split()[1] for h in sections_of if h.startswith("backwash ")}, verbs)
    for verb in verbs & {h.split()[1] for h in sections_of if h.startswith("backwash ")}:
        # Options stand in the tables' first column.
        cells = [c for c in rows(sections_of[f"backwash {verb}"]) if c[0].startswith("`-")]
        inner, options = help_of(str(services / "backwash"), verb)
        for below in inner:
            options |= help_of(str(services / "backwash"), verb, below)[1]
            if f"`backwash {verb} {below}`" not in sections_of[f"backwash {verb}"]:
                wrong.append(f"backwash {verb}: {below} is not documented")
        expect(f"backwash {verb}", {o for c in cells for o in options_in(c[0])} | every, options)
        check_defaults(f"backwash {verb}", [str(services / "backwash"), verb], [" ".join(c) for c in cells])
    for program in ("backwashd", "backwash-bench"):
        _, options = help_of(str(services / program))
        expect(program, {o for c in rows(sections_of[program]) for o in options_in(c[0])}, options)
        check_defaults(program, [str(services / program)], [" ".join(c) for c in rows(sections_of[program])])
    verbs, common = help_of(str(services / "backwashctl"))
    listed = [c for c in rows(sections_of["backwashctl"]) if len(c) == 3 and c[0].startswith("`")]
    expect("verbs of backwashctl", {v for c in listed for v in quoted(c[0])}, verbs)
    every, of_verbs = options_in(sections_of["backwashctl"].split("\n|")[0]), set()
    expect("backwashctl", every, common)
    check_defaults("backwashctl", [str(services / "backwashctl")], [sections_of["backwashctl"].split("\n|")[0]])
    for cells in listed:
        actual = set()
        for verb in set(quoted(cells[0])) & verbs:
            actual |= help_of(str(services / "backwashctl"), verb)[1]
        expect(f"backwashctl {cells[0]}", options_in(cells[2]), actual)


# --- JSON and exit codes ---------------------------------------------------------------------------------------------

def names_of_json(text: str) -> set[str]:
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
    files = list((root / "services/backwash").glob("*.cpp")) + [root / "services/backwashctl" / name for name in ("status_output.cpp", "verbs.cpp")]
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
    for measures in (root / "core/sim").glob("compare*.cpp"):  # names of Measure
        written |= set(re.findall(r'"([a-z]\w*)"', measures.read_text()))
    for heading, section in sections_of.items():
        tables = re.split(r"\n\n", section)
        for table in tables:
            if not table.lstrip().startswith("| JSON") and heading != "JSON of status":
                continue
            for cells in rows(table)[1:]:
                for name in quoted(cells[0]):
                    for part in re.findall(r"\w+", name):
                        if part not in written:
                            wrong.append(f"{heading}: no JSON is called {part}")


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
    code = (root / "core/log/column_units.cpp").read_text().split("kinds() {")[1].split("return all;")[0]
    actual = set(re.findall(r'"(\w+)"', code))
    shown = {q for c in rows(sections_of["Flight log, CSV"])[1:] for q in quoted(c[0])}
    in_words = set(re.findall(r"\w+", " ".join(quoted(sections_of["Column map"]))))  # what only a foreign table has

    def first(column: str) -> str:
        return re.sub(r"^(rpm|motor)[2-4]$", r"\g<1>1", re.sub(r"^((?:cmd_)?[va]?|specific_force_)[yz](?=_m|$)", r"\1x", column))

    wrong.extend(f"Flight log, CSV: not documented: {c}" for c in sorted(actual) if not {c, first(c)} & (shown | in_words))
    wrong.extend(f"Flight log, CSV: does not exist: {c}" for c in sorted(shown - actual))
    if len(actual) < 30:
        wrong.append(f"Flight log, CSV: only {len(actual)} columns were found in core/log/column_units.cpp")


def check_tables(root: pathlib.Path, text: str) -> None:
    """The columns of every table that a program writes are somewhere in the page, as the code's first line names them."""
    named = {part for q in quoted(text) for part in re.findall(r"\w+", q)}
    found = 0
    for file in sorted((root / "services").rglob("*.[ch]pp")):
        code = re.sub(r'"\s*"', "", file.read_text())  # one text over several lines
        for line in re.findall(r'"(\w+(?:,\w+){3,})(?:\\n|")', code):
            found += 1
            columns = {re.sub(r"^(.*_|[va]?)[yz](?=_m|$)", r"\1x", c) if c not in named else c for c in line.split(",")}
            wrong.extend(f"{file.relative_to(root)}: the column {c} is not documented" for c in sorted(columns - named))
    if found < 3:
        wrong.append(f"only {found} tables were found in services")


# --- DDS and MAVLink -------------------------------------------------------------------------------------------------

DELIVERY = {"latest": "best effort, keep last 1", "scans": "best effort, keep last 8", "status": "reliable, keep last 1",
            "parts": "best effort, keep last 64", "reliable": "reliable, keep last 64",
            "state": "reliable, transient local, keep last 1"}


def check_dds(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    types = re.findall(r'Typed<(\w+)_desc, topic_named\("(\w+)"\)>', (root / "services/dds/topics.hpp").read_text())
    type_of = {name: type_.replace("_msg_dds__", "::msg::dds_::") for type_, name in types}
    actual = {(name, type_of.get(name), DELIVERY[delivery], "out" if "kVehicle" in writers else "in") for name, delivery, writers in
              re.findall(r'\{"(\w+)", Delivery::(\w+), (.+)\},', (root / "idl/topics.hpp").read_text())}
    documented = {(re.search(r"/(\w+)(?: |$)", c[0])[1], c[1], c[3], c[2]) for c in rows(sections_of["DDS"])[1:]}
    expect("DDS topics", documented, actual)
    idl = (root / "idl/backwash_msgs.idl").read_text()
    for prefix in ("COMMAND_", "ACK_"):
        cells = [c[0] for c in rows(sections_of["Commands"])]
        expect(f"{prefix}…", {w for c in cells for w in re.findall(rf"{prefix}\w+", c)},
               set(re.findall(rf"const octet ({prefix}\w+)", idl)))
    status = {q for c in rows(sections_of["JSON of status"])[1:] for q in quoted(c[0])}
    expect("JSON of status", status, names_of_status(root))


def check_mavlink(root: pathlib.Path, sections_of: dict[str, str]) -> None:
    actual = set()
    for file in (root / "firmware_bridge/mavlink").glob("*.hpp"):
        actual |= set(re.findall(r'kName = "([A-Z0-9_]+)"', file.read_text()))
    section = sections_of["MAVLink"]
    cells = " ".join(c[0] for c in rows(section))
    words = set(re.findall(r"\b[A-Z][A-Z0-9]*(?:_[A-Z0-9]+)*\b", cells + section.split("The codec knows more")[1].split("\n\n")[0]))
    expect("MAVLink messages", words, actual)


def main() -> int:
    root, build = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    text = (root / "docs/interfaces.md").read_text()
    sections_of = sections(text)
    check_keys(root, build, sections_of)
    check_programs(root, build, sections_of)
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
