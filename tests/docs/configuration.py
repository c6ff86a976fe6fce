# SPDX-License-Identifier: BSD-3-Clause
"""Keys of the files that docs/interfaces.md documents: names by the programs, range, presence and default by the code."""
import pathlib
import re
import subprocess
import tempfile

from page import expect, quoted, rows, wrong


def interval(code: str, constants: dict[str, str]) -> str:
    """A Range of the code, {low, high[, above_low]}, as the document writes it."""
    parts = [p.strip().replace("'", "") for p in constants.get(code, code).strip("{}").split(",")]
    return f"{'(' if len(parts) > 2 else '['}{parts[0]}, {parts[1]}]"


def keys_of_program(command: list[str], table: str = "") -> set[str]:
    """The keys that a program knows, by asking it for one that it does not know; in `command` FILE is the file's name."""
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as file:
        file.write((f"[{table}]\n" if table else "") + "no_such_key = 1\n")
        file.flush()
        run = subprocess.run([w.replace("FILE", file.name) for w in command], capture_output=True, text=True, check=False)
    known = re.search(r"no_such_key' = 1: unknown; known here: (.*)", run.stderr)
    if not known:  # no table: a key
        return {table}
    return {key for name in known[1].split(", ")
            for key in keys_of_program(command, f"{table}.{name}" if table else name)}


def keys_of_code(source: str) -> dict[str, tuple[str, bool]]:
    """Key → (range, needed) of a file of core/config; texts and flags have no range."""
    constants = dict(re.findall(r"constexpr Range (\w+)(\{[^}]*\})", source))
    keys = {}
    for key, spec, presence in re.findall(r'\{"([\w.]+)", &[\w.()]+, (\{[^}]*\}|\w+)(?:, ([\w:]+))?\}', source):
        keys[key] = (interval(spec, constants), presence == "")
    table = re.search(r"TextKey texts\[\] = \{(.*?)\n  \};", source, re.S)
    for key in re.findall(r'\{"([\w.]+)", &', table[1] if table else ""):
        keys[key] = ("", True)
    for body in re.findall(r"TextKey optional\[\] = \{(.*?)\};", source, re.S):
        keys.update({key: ("", False) for key in re.findall(r'\{"([\w.]+)", &', body)})
    for body in re.findall(r"std::string_view(?:> text_keys| k\w+\[\] =) ?\{([^}]*)\}", source):
        keys.update({key: ("", key == "name") for key in re.findall(r'"([\w.]+)"', body)})
    return keys


def members(code: str) -> dict[str, float]:
    """Numbers that members of a struct begin with, by their path in it: map.max_mib → 512."""
    found: list[tuple[int, str, float]] = []  # depth, path, number
    depth = 0
    for line in re.sub(r"//[^\n]*", "", code).splitlines():
        if closed := re.match(r"\s*\} (\w+);", line):
            found = [(depth - 1, f"{closed[1]}.{path}", x) if at >= depth else (at, path, x) for at, path, x in found]
        if re.match(r"\s*(?:double|int)\b", line):
            found += [(depth, name, float(x)) for name, x in re.findall(r"(\w+) = (-?[\d.]+)", line)]
        depth += line.count("{") - line.count("}")
    return {path: x for _, path, x in found}


def check_key_defaults(root: pathlib.Path, heading: str, file: str, headers: tuple[str, ...], section: str) -> None:
    source = (root / f"core/config/{file}.cpp").read_text()
    values = members(source)
    for header in headers:
        values |= members((root / header).read_text())
    compared = 0
    for cells in rows(section):
        told = re.match(r"(-?[\d.]+)(?:$|; pair)", cells[3]) if len(cells) == 6 and quoted(cells[0]) else None
        target = told and re.search(rf'\{{"{re.escape(quoted(cells[0])[0])}", &\w+\.([\w.]+),', source)
        path = target and re.sub(r"^bound\.", "", target[1])
        if path in values:
            compared += 1
            if values[path] != float(told[1]):
                wrong.append(f"{heading}: {quoted(cells[0])[0]} has the default {values[path]:g}, not {told[1]}")
    if compared < 3:
        wrong.append(f"{heading}: only {compared} defaults were compared")


def check_keys(root: pathlib.Path, build: pathlib.Path, sections_of: dict[str, str]) -> None:
    backwash, backwashd = str(build / "services/backwash"), str(build / "services/backwashd")
    for heading, file, reads in (
            ("Vehicle file", "vehicle_file", [backwash, "reach", "--vehicle", "FILE", "--track", "none"]),
            ("Model file", "model_file", [backwash, "field", "--map", "builtin:narrow-gap", "--model", "FILE", "--at", "1,1,1"]),
            ("Daemon file", "daemon_file", [backwashd, "--check-config", "--config", "FILE"])):
        check_key_defaults(root, heading, file, {"vehicle_file": ("core/types/vehicle.hpp",), "model_file": (
            "core/types/model.hpp", "core/types/disturbance.hpp"), "daemon_file": ("core/config/daemon_config.hpp",)}[file], sections_of[heading])
        keys = keys_of_program(reads)
        parts = sorted((root / "core/config").glob(file.replace("_file", "_parts.*")))
        actual = keys_of_code("".join(f.read_text() for f in [*parts, root / f"core/config/{file}.cpp"]))
        documented = {}
        for cells in rows(sections_of[heading]):
            if len(cells) == 6 and quoted(cells[0]):
                documented[quoted(cells[0])[0]] = (cells[2].replace("∞", "inf"), cells[3])
        free = {"confidence", "provenance", "extension"} if file == "model_file" else set()  # in words below the table
        wrong.extend(f"{heading}: not documented: {x}" for x in free if f"`{x}`" not in sections_of[heading])
        expect(heading, set(documented), keys - free)
        if len(keys) < 15 or len(actual) < len(keys) - 5:
            wrong.append(f"{heading}: only {len(keys)} keys were told, {len(actual)} found in core/config/{file}.cpp")
        for key in documented.keys() & actual.keys():
            range_, needed = actual[key]
            if documented[key][0] != range_:
                wrong.append(f"{heading}: {key} has the range {range_ or '(none)'}, not {documented[key][0]}")
            if (documented[key][1] == "needed") != needed:
                wrong.append(f"{heading}: {key} is {'needed' if needed else 'not needed'}")
    spec = (root / "services/backwash/flight_spec.cpp").read_text()
    known = re.search(r'only\(path, file, \{([^}]*)\}', spec)[1]
    expect("Flight specification", {quoted(c[0])[0] for c in rows(sections_of["Flight specification"])[1:]},
           set(re.findall(r'"(\w+)"', known)))
