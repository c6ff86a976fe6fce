#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One version: project(VERSION) of CMakeLists.txt owns it. Programs and Debian packages take it from there; what has to write it
out again, the ROS 2 packages and the newest release of CHANGELOG.md, says the same.

version.py SOURCE_DIR
"""
import pathlib
import re
import sys


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    version = re.search(r"^project\(\w+ VERSION (\S+)", (root / "CMakeLists.txt").read_text(), re.M)[1]
    written = {path: re.findall(r"<version>(.*?)</version>", path.read_text()) for path in (root / "ros2").glob("*/package.xml")}
    changes = root / "CHANGELOG.md"
    written[changes] = re.findall(r"^## (\d\S*) \(\d{4}-\d\d-\d\d\)$", changes.read_text(), re.M)[:1]
    wrong = [f"{path.relative_to(root)}: {found or 'no version'}, CMakeLists.txt has {version}" for path, found in written.items() if found != [version]]
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong or len(written) < 3 else 0


if __name__ == "__main__":
    sys.exit(main())
