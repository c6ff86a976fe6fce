#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ros2/backwash_msgs says what idl/backwash_msgs.idl says: each message, its members in order, their types, its constants.

ros2_messages.py SOURCE_DIR

ROS 2 matches a message by its type's name and reads it by its members' order alone: one that differs is read as nonsense.
"""
import pathlib
import re
import sys

# As rosidl maps them (design.ros2.org, "IDL interface definition").
TYPES = {"uint8": "uint8", "boolean": "bool", "float": "float32", "double": "float64", "long": "int32",
         "unsigned long": "uint32", "unsigned long long": "uint64", "string": "string"}


def in_ros(type_: str) -> str:
    if named := re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", type_):
        return f"{named[1]}/{named[2]}"
    if many := re.fullmatch(r"sequence<(.+?)(?:, *(\d+))?>", type_):
        return in_ros(many[1]) + (f"[<={many[2]}]" if many[2] else "[]")
    return TYPES[type_] if type_ in TYPES else re.fullmatch(r"(\w+)_", type_)[1]


def of_idl(text: str) -> dict[str, list[str]]:
    """Message → its lines: constants sorted by value, then members in order."""
    bare = re.sub(r"//[^\n]*", "", text)
    messages = {}
    for name, body in re.findall(r"struct (\w+)_ \{(.*?)\};", bare, re.S):
        constants = re.findall(rf"const octet {name.upper()}_(\w+) = (\d+);", bare)
        members = []
        for member in filter(None, map(str.strip, body.split(";"))):
            type_, member_name, array = re.fullmatch(r"(.+?)\s+(\w+)(\[\d+\])?", member, re.S).groups()
            members.append(f"{in_ros(type_)}{array or ''} {member_name}")
        messages[name] = [f"uint8 {c}={v}" for c, v in sorted(constants, key=lambda c: int(c[1]))] + members
    used = sum(len([line for line in lines if "=" in line and "<=" not in line]) for lines in messages.values())
    assert used == len(re.findall(r"\bconst ", bare)), "a constant belongs to no message"
    return messages


def of_msg(path: pathlib.Path) -> list[str]:
    lines = [re.sub(r"\s*#.*", "", line).strip() for line in path.read_text().splitlines()]
    lines = [" ".join(line.split()) for line in lines if line]
    constants = [line for line in lines if re.search(r"[A-Z]=\d", line)]
    return sorted(constants, key=lambda c: int(c.split("=")[1])) + [line for line in lines if line not in constants]


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    package = root / "ros2/backwash_msgs"
    wanted = of_idl((root / "idl/backwash_msgs.idl").read_text())
    found = {path.stem: of_msg(path) for path in (package / "msg").glob("*.msg")}
    wrong = [f"{name}.msg is missing, or in the IDL" for name in wanted.keys() ^ found.keys()]
    for name in wanted.keys() & found.keys():
        for line in range(max(len(wanted[name]), len(found[name]))):
            one, other = (lines[line] if line < len(lines) else "nothing" for lines in (wanted[name], found[name]))
            if one != other:
                wrong.append(f"{name}.msg: '{other}' where idl/backwash_msgs.idl has '{one}'")
    packages = {t.split("/")[0] for lines in wanted.values() for t in lines if "/" in t}
    manifest, build = (package / "package.xml").read_text(), (package / "CMakeLists.txt").read_text()
    wrong += [f"package.xml or CMakeLists.txt does not name {p}" for p in packages
              if f"<depend>{p}</depend>" not in manifest or f"find_package({p} REQUIRED)" not in build]
    if set(re.findall(r"msg/(\w+)\.msg", build)) != set(wanted):
        wrong.append("CMakeLists.txt lists other messages than the IDL has")
    print("\n".join(wrong) or f"{len(wanted)} messages, {sum(map(len, wanted.values()))} members and constants")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
