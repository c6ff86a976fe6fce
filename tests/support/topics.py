#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The vehicle's topics as docs/interfaces.md has them: name, type, `in` or `out`, and the most that a reader may ask of one:
`latched`, `default` (reliable) or `sensor` (best effort).

topics.py SOURCE_DIR    a line each
"""
import pathlib
import re
import sys


def topics_of(root: pathlib.Path) -> list[tuple[str, str, str, str]]:
    found = re.findall(r"^\| rt/NAMESPACE/(\w+)[^|]* \| (\S+) \| (in|out) \| ([^|]+) \|", (root / "docs/interfaces.md").read_text(), re.M)
    assert found, "docs/interfaces.md has no table of topics"
    quality = lambda said: "latched" if "transient local" in said else "default" if said.startswith("reliable") else "sensor"
    return [(name, type_, way, quality(delivery)) for name, type_, way, delivery in found]


if __name__ == "__main__":
    for topic in topics_of(pathlib.Path(sys.argv[1])):
        print(*topic)
