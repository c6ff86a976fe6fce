#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws docs/door.svg, the README's picture, from what `backwash plan`, `fly` and `field` say: a door of 1 m, refused to a
constant margin of 0.35 m (tests/race/README.md: the smallest one with which no vehicle touched) and passed by the sets.

figure.py [BACKWASH]
"""
import csv
import json
import pathlib
import subprocess
import sys
import tempfile

BACKWASH = sys.argv[1] if len(sys.argv) > 1 else "backwash"
WORLD = ["--map", "builtin:narrow-gap", "--model", "builtin:quad-5in", "--vehicle", "builtin:quad-5in"]
WAY = ["--start", "1,0,1", "--goal", "5,0,1"]
MARGIN = 0.35
BODY = 0.16 + 0.02  # m: body.radius and estimation.position of quad-5in
SCALE, LEFT, RIGHT, HALF = 112, 1.4, 4.7, 1.1  # pixels a metre; the part of the map that is shown, m
VOXEL = 0.1
STYLE = """
rect { shape-rendering: crispEdges } text { font: 15px sans-serif; fill: #1f2328 } .page { fill: #ffffff } .wall { fill: #57606a } .air { fill: #d1701a }
.body { fill: #0969da; fill-opacity: .2 } .set { fill: #0969da; fill-opacity: .55 } .way { fill: none; stroke: #0a3069; stroke-width: 2 }
.no { fill: #cf222e; fill-opacity: .25; stroke: #cf222e; stroke-width: 2 } .solid { fill: #1f2328 }
@media (prefers-color-scheme: dark) {
text { fill: #e6edf3 } .page { fill: #0d1117 } .wall { fill: #8b949e } .air { fill: #f0883e } .way { stroke: #cae8ff } .solid { fill: #e6edf3 }
.body, .set { fill: #58a6ff } .no { fill: #ff7b72; stroke: #ff7b72 } }"""


def said(verb: str, *options: str, code: int = 0) -> str:
    run = subprocess.run([BACKWASH, verb, *options, "--quiet"], capture_output=True, text=True, check=False)
    assert run.returncode == code, run.stderr
    return run.stdout


def main() -> None:
    field = json.loads(said("field", *WORLD, "--slice", "z=1.0", "--json"))["points"]
    tube = json.loads(said("plan", *WORLD, *WAY, "--json"))["tube"]
    said("plan", *WORLD, *WAY, "--margin", str(MARGIN), code=69)
    with tempfile.TemporaryDirectory() as folder:
        log = pathlib.Path(folder, "log.csv")
        said("fly", *WORLD, *WAY, "--log", str(log))
        with log.open() as file:
            flown = [(float(r["x_m"]), float(r["y_m"])) for r in csv.DictReader(line for line in file if not line.startswith("#"))]

    def place(x: float, y: float) -> str:
        return f"{(x - LEFT) * SCALE:.1f},{(HALF - y) * SCALE:.1f}"

    def ball(x: float, y: float, radius: float, kind: str) -> str:
        px, py = place(x, y).split(",")
        return f'<circle cx="{px}" cy="{py}" r="{radius * SCALE:.1f}" class="{kind}"/>'

    def cells(kind: str, shown) -> str:
        return "".join(f'<rect x="{place(x - VOXEL / 2, 0).split(",")[0]}" y="{place(0, y + VOXEL / 2).split(",")[1]}" width="{VOXEL * SCALE:.1f}" '
                       f'height="{VOXEL * SCALE:.1f}" class="{kind}"{more}/>\n' for x, y, more in shown)

    def band(kind: str, grown: float) -> str:
        inside = [s for s in tube if s["t"] < 5.0]
        upper = [place(s["center"][0], s["center"][1] + s["half_widths"]["y"] + grown) for s in inside]
        lower = [place(s["center"][0], s["center"][1] - s["half_widths"]["y"] - grown) for s in reversed(inside)]
        return f'<polygon points="{" ".join(upper + lower)}" class="{kind}"/>'

    near = [p for p in field if LEFT < p["p"][0] < RIGHT and abs(p["p"][1]) < HALF]
    most = max(p["sigma"][0] for p in near)
    free = {(round(p["p"][0], 2), round(p["p"][1], 2)) for p in near}
    centres = [(round(LEFT + VOXEL * (i + 0.5), 2), round(-HALF + VOXEL * (j + 0.5), 2)) for i in range(33) for j in range(22)]
    walls = cells("wall", [(x, y, "") for x, y in centres if (x, y) not in free])
    air = cells("air", [(*p["p"][:2], f' fill-opacity="{0.45 * p["sigma"][0] / most:.2f}"') for p in near])
    width, height = (RIGHT - LEFT) * SCALE, 2 * HALF * SCALE
    refused = ball(3.05, 0, BODY + MARGIN, "no") + ball(3.05, 0, BODY, "solid")
    way = " ".join(place(x, y) for x, y in flown[::5])
    passed = band("body", BODY) + band("set", 0) + f'<polyline points="{way}" class="way"/>' + ball(3.05, 0, BODY, "solid")
    panels = [(f"One constant margin, {MARGIN} m: no way", refused), ("The reachable sets: planned, flown, all inside", passed)]
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {2 * width + 30:.0f} {height + 34:.0f}">', f"<style>{STYLE}</style>",
           '<rect width="100%" height="100%" class="page"/>']
    for i, (title, drawn) in enumerate(panels):
        out += [f'<text x="{i * (width + 30) + 4:.0f}" y="21">{title}</text>',
                f'<svg x="{i * (width + 30):.0f}" y="34" width="{width:.0f}" height="{height:.0f}">', air, walls, drawn, "</svg>"]
    (pathlib.Path(__file__).parent / "door.svg").write_text("\n".join(out) + "\n</svg>\n")


if __name__ == "__main__":
    main()
