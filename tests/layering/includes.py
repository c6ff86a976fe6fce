#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The layers of the code, from its include lines: each folder includes itself and only the folders named for it here.

includes.py SOURCE_DIR

A source file below core, services, research or firmware_bridge that no folder of the table holds belongs to no layer, and fails. So does
a folder of the table that is not there, or one that the table lets include a folder above it. Included is by the path from the
project's root: a path from the file's own folder would hide where it leads. Either bracket counts. Comments, continued lines and
digraphs hide nothing, and an include that is no literal, an absolute path or an import of a module is refused as not to be read.
"""
import pathlib
import re
import sys

# From the ground up: a folder sees only folders above its own line.
STUDY = "core/study/"
FLIGHT = ["core/types", "core/loop", "core/map", "core/field", "core/reach", "core/plan", "core/track"]
MAY = {
    "core/types": [],
    "core/loop": ["core/types"],
    "core/files": [],
    "core/sync": ["core/types"],
    "core/config": ["core/types", "core/files"],
    "core/map": ["core/types", "core/files"],
    "core/field": ["core/types", "core/map"],
    "core/reach": FLIGHT[:4],
    "core/adapt": FLIGHT[:5],
    "core/plan": FLIGHT[:5],
    "core/track": FLIGHT[:6],
    "core/log": ["core/files", "core/adapt", *FLIGHT],
    "core/sim": ["core/log", *FLIGHT],
    "core/report": ["core/files", "core/log", "core/sim", *FLIGHT],
    STUDY + "windows": ["core/types", "core/loop", "core/map", "core/field", "core/log"],
    STUDY + "calibrate": ["core/types", "core/config", "core/map", "core/field", "core/log", "core/report", STUDY + "windows"],
    STUDY + "effects": ["core/types", "core/map", "core/field", STUDY + "windows"],
    STUDY + "loop": ["core/types", "core/loop", "core/log", STUDY + "windows"],
    STUDY + "inference": ["core/types", STUDY + "windows", STUDY + "effects"],
    STUDY + "findings": ["core/types", "core/loop", "core/config", "core/map", "core/field", "core/plan", "core/report",
                         STUDY + "windows", STUDY + "calibrate", STUDY + "effects", STUDY + "inference"],
    STUDY + "design": ["core/types", "core/map", "core/plan", "core/log", STUDY + "windows", STUDY + "effects",
                       STUDY + "inference", STUDY + "findings"],
    STUDY + "before_after": ["core/types", "core/log", "core/report", STUDY + "windows", STUDY + "findings"],
    "firmware_bridge/autopilots": [],
    "firmware_bridge": ["core/types"],
    "services/parallel": [],
    "services/command_line": [],
    "services/security": ["idl"],
    "services/dds": ["idl", "services/security"],
    "services/maps": ["core/types", "core/files", "core/map", "core/log"],
    # What flies sees neither the simulation nor what judges flights afterwards.
    "services/backwashd": ["core/sync", "core/config", "core/adapt", "core/log", *FLIGHT, "firmware_bridge", "services/security",
                           "services/dds", "services/parallel", "services/command_line"],
    "services/backwashctl": ["core/files", "core/config", *FLIGHT[:6], "services/security", "services/dds", "services/command_line"],
    "services/bench": ["core/config", "core/sim", *FLIGHT, "firmware_bridge", "services/security", "services/dds",
                       "services/parallel", "services/command_line"],
    "services/backwash": ["core", "firmware_bridge/autopilots", "services/security", "services/maps", "services/parallel", "services/command_line"],
    "services/python": ["core", "services/command_line", "services/backwash"],
    "services/package": ["core/config", *FLIGHT],  # the library's example
    "research": ["core", "services/backwash"],
}
# The worlds with hidden effects share no code with what looks for them. These ask the study, and no world includes them.
ASKS_THE_STUDY = {"design_main", "design_trial", "matrix", "null_size", "observe", "oracle", "score", "shares", "shares_main", "simulation",
                  "simulation_main", "summary"}
# DDS with what idl/ generates, MAVLink, GPIO and sockets, systemd, threads with all that only threads need; core/sync has <atomic>.
FORBIDDEN = re.compile(r"(\w+/)*(dds|gpio|systemd|mavlink|c?thread|pthread|jthread|s?mutex|shared_mutex|future|condition_variable|"
                       r"semaphore|barrier|latch|stop_token|execution|omp\.h|tbb|termios|ros2\.h|backwash_msgs|assimp|liblzf|lz4|zstd)|sys/socket|netinet/|linux/")
INCLUDE = re.compile(r'^\s*(?:#|%:|\?\?=)\s*(?:include|include_next|import|embed)\b\s*(?:["<]([^">]+)[">])?')
MODULE = re.compile(r"^\s*(?:export\s+)?(?:import\b(?!\s*[=.(,;])|module\b\s*[\w:;])")
LITERAL = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"', re.S)
SOURCES = {".cpp", ".hpp", ".c", ".h", ".cc", ".cxx", ".hh", ".hxx", ".ipp", ".tpp", ".inl", ".inc"}


def below(path: str, folder: str) -> bool:
    return path.startswith(folder + "/")


def folder_of(path: str) -> str | None:
    return next((folder for folder in MAY if below(path, folder)), None)


def lines_of(text: str) -> list[str]:
    """The lines as a compiler reads them: continued ones joined, comments gone, raw strings empty; as many as there were."""
    def kept(match: re.Match) -> str:
        literal = match[0]
        if literal.startswith('"'):
            return literal
        return ('""' if literal[0] == "R" else " ") + "\n" * literal.count("\n")
    joined = re.sub(r"((?:[^\n]*\\[ \t]*\n)+)([^\n]*)",
                    lambda m: re.sub(r"\\[ \t]*\n", "", m[1]) + m[2] + "\n" * m[1].count("\n"), text)
    return LITERAL.sub(kept, joined).split("\n")


def table_errors(root: pathlib.Path) -> list[str]:
    order = list(MAY)
    wrong = [f"the table of layers: there is no {folder}" for folder in order if not (root / folder).is_dir()]
    for n, folder in enumerate(order):
        wrong += [f"the table of layers: {folder} is below {seen}" for seen in MAY[folder] if seen in order[n:]]
    return wrong


def file_errors(root: pathlib.Path, path: pathlib.Path) -> list[str]:
    name, wrong = path.relative_to(root).as_posix(), []
    folder = folder_of(name)
    for n, line in enumerate(lines_of(path.read_text()), 1):
        if MODULE.match(line):
            wrong.append(f"{name}:{n}: modules are not read here")
        included = INCLUDE.match(line)
        if not included:
            continue
        if not included[1] or included[1].startswith("/"):
            wrong.append(f"{name}:{n}: shall include a path from the project's root, by name")
            continue
        # A C library that others copy, both files together, finds its header beside it.
        copied = path.suffix == ".c" and included[1] == path.stem + ".h"
        if not copied and (path.parent / included[1]).is_file() and not (root / included[1]).is_file():
            wrong.append(f"{name}:{n}: {included[1]} shall be included by its path from the root")
        if (root / included[1]).is_file() and pathlib.Path(included[1]).suffix not in SOURCES | {".inc"}:
            wrong.append(f"{name}:{n}: {included[1]} has a suffix that is not read here")
        if below(name, "core") and FORBIDDEN.match(included[1]):
            wrong.append(f"{name}:{n}: core may not include DDS, MAVLink, GPIO, systemd, thread or mesh headers")
        if below(name, "core") and included[1] == "atomic" and folder != "core/sync":
            wrong.append(f"{name}:{n}: of core only core/sync may include <atomic>")
        if ".." in included[1].split("/"):
            wrong.append(f"{name}:{n}: {included[1]} shall be included by its path from the root")
        if folder and below(included[1], "tests"):
            wrong.append(f"{name}:{n}: {folder} may not include tests")
        # Generated headers (IDL, embedded configuration) have no folder of ours in their name.
        ours = below(included[1], "core") or below(included[1], "services") or folder_of(included[1])
        if not ours and not name.startswith("tests/"):
            continue
        if name.startswith("tests/") and (below(included[1], "core/study") or pathlib.Path(included[1]).stem in ASKS_THE_STUDY):
            wrong.append(f"{name}:{n}: a world with a hidden effect may not include {included[1]}, which looks for it")
        elif folder and not any(below(included[1], seen) for seen in [folder, *MAY[folder]]):
            wrong.append(f"{name}:{n}: {folder} may not include {included[1]} (allowed: {' '.join(MAY[folder]) or 'itself'})")
    return wrong


def main() -> int:
    root = pathlib.Path(sys.argv[1]).resolve()
    wrong, seen = table_errors(root), 0
    for top in ("core", "firmware_bridge", "services", "research"):
        for path in sorted(p for p in (root / top).rglob("*") if p.suffix in SOURCES):
            if not folder_of(path.relative_to(root).as_posix()):
                wrong.append(f"{path.relative_to(root)}: belongs to no layer")
            wrong += file_errors(root, path)
            seen += 1
    for path in sorted((root / "tests/study_worlds").glob("*pp")):
        wrong += file_errors(root, path) if path.stem not in ASKS_THE_STUDY else []
    if seen < 200:
        wrong.append(f"only {seen} source files were found")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
