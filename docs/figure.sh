#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Draws docs/flight.svg, the README's picture: the flight that ./fly makes through the apartment's doorway, by
# `backwash fly`. Left the walls and the tube, right the field at flight height; both are figures of the flight's page.
#   figure.sh [BACKWASH]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
page=$(mktemp --suffix .html)
trap 'rm -f "$page"' EXIT
"${1:-backwash}" fly --map builtin:apartment --start 3.0,4.2,1.2 --goal 7.4,3.0,1.2 --report "$page" --force >/dev/null
python3 - "$page" "$here/flight.svg" <<'PYTHON'
import re
import sys

page = open(sys.argv[1]).read()
figures = [re.search(rf"<h2>{title}</h2>.*?(<svg.*?</svg>)", page, re.S)[1] for title in ("From above", "Disturbance at flight height")]
sizes = [[float(x) for x in re.search(r'viewBox="0 0 (\S+) (\S+)"', figure).groups()] for figure in figures]
height = max(size[1] for size in sizes)
placed, left = "", 0.0
for figure, size in zip(figures, sizes):
    text = re.sub(r"(\d+\.\d)\d+", r"\1", figure)  # a tenth of a pixel
    placed += text.replace("<svg", f'<svg x="{left:g}" y="0" width="{size[0]:g}" height="{size[1]:g}"', 1) + "\n"
    left += size[0]
with open(sys.argv[2], "w") as out:
    out.write(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {left:g} {height:g}">\n'
              f'<rect width="{left:g}" height="{height:g}" fill="#ffffff"/>\n{placed}</svg>\n')
PYTHON
