#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""ros2/backwash_msgs, printed from idl/backwash_msgs.idl: its messages, with their comments, and its list of them.

ros2_messages.py SOURCE_DIR            writes them
ros2_messages.py SOURCE_DIR --check    1 if a file says anything else

ROS 2 matches a message by its type's name and reads it by its members' order alone: one that differs is read as nonsense.
"""
import pathlib
import re
import sys

# As rosidl maps them (design.ros2.org, "IDL interface definition").
TYPES = {"uint8": "uint8", "boolean": "bool", "float": "float32", "double": "float64", "long": "int32",
         "unsigned long": "uint32", "unsigned long long": "uint64", "string": "string"}
HEAD = "# SPDX-License-Identifier: BSD-3-Clause\n"


def in_ros(type_: str) -> str:
    if named := re.fullmatch(r"(\w+)::msg::dds_::(\w+)_", type_):
        return f"{named[1]}/{named[2]}"
    if many := re.fullmatch(r"sequence<(.+?)(?:, *(\d+))?>", type_):
        return in_ros(many[1]) + (f"[<={many[2]}]" if many[2] else "[]")
    return TYPES[type_] if type_ in TYPES else re.fullmatch(r"(\w+)_", type_)[1]


def member(text: str, said: str) -> str:
    type_, name, array = re.fullmatch(r"(.+?)\s+(\w+)(\[\d+\])?", text.strip(), re.S).groups()
    return f"{in_ros(type_)}{array or ''} {name}" + (f"  # {said}" if said else "") + "\n"


def messages_of(idl: str) -> dict[str, str]:
    """Message → its file. Constants stand before their struct and begin with its name."""
    messages, constants, about, inside = {}, "", "", None
    for line in idl.splitlines():
        code, _, said = (part.strip() for part in line.partition("//"))
        if inside is not None:
            if code == "};":
                messages[inside[0]] = inside[1]
                inside = None
            elif code:
                said = re.sub(rf"^{inside[0].upper()}_…", "one of the above", said)
                inside = (inside[0], inside[1] + member(code.rstrip(";"), said))
        elif constant := re.fullmatch(r"const octet [A-Z]+?_(\w+) = (\d+);", code):
            constants += f"uint8 {constant[1]}={constant[2]}" + (f"  # {said}" if said else "") + "\n"
        elif begun := re.match(r"@final struct (\w+)_ \{(.*)", code):
            head = HEAD + about + (constants + "\n" if constants else "")
            constants = about = ""
            inside = (begun[1], head)
            if begun[2]:
                messages[begun[1]] = head + "".join(member(m, "") for m in begun[2].split("}")[0].split(";") if m.strip())
                inside = None
        elif said and not code and not constants:
            about += f"# {said}\n"
        elif not line.strip():
            about = about if constants else ""
    assert not constants, "a constant belongs to no message"
    return messages


def files_of(root: pathlib.Path) -> dict[pathlib.Path, str]:
    package = root / "ros2/backwash_msgs"
    messages = messages_of((root / "idl/backwash_msgs.idl").read_text())
    files = {package / f"msg/{name}.msg": text for name, text in messages.items()}
    packages = sorted({p for text in messages.values() for p in re.findall(r"^(\w+)/", text, re.M)})
    build = (package / "CMakeLists.txt").read_text()
    build = re.sub(r"(?<=ament_cmake REQUIRED\)\n)(find_package\((?!rosidl)\w+ REQUIRED\)\n)*",
                   "".join(f"find_package({p} REQUIRED)\n" for p in packages), build)
    listed = "".join(f"  msg/{name}.msg\n" for name in sorted(messages))
    files[package / "CMakeLists.txt"] = re.sub(r"(?<=\$\{PROJECT_NAME\}\n).*(?=\n\nament_export)",
                                               f"{listed}  DEPENDENCIES {' '.join(packages)})", build, flags=re.S)
    files[package / "package.xml"] = re.sub(r"(  <depend>\w+</depend>\n)+", "".join(f"  <depend>{p}</depend>\n" for p in packages),
                                            (package / "package.xml").read_text())
    return files


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    files = files_of(root)
    found = set((root / "ros2/backwash_msgs/msg").glob("*.msg"))
    wrong = [f"{path}: no such message" for path in found - files.keys()]
    wrong += [f"{path} is not what idl/ros2_messages.py writes" for path, text in files.items()
              if not path.exists() or path.read_text() != text]
    if len(sys.argv) < 3:
        for path in found - files.keys():
            path.unlink()
        for path, text in files.items():
            path.write_text(text)
        return 0
    print("\n".join(wrong) or f"{len(files) - 2} messages")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
