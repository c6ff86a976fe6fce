#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A room of somebody else's, as a mesh in millimetres with y up and as a cloud, becomes a map whose free volume is known, is
# mended, looked at and flown in.
#   map.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"

# 6 x 4 x 2.4 m of air, walls in the middle of voxels of 0.1 m, and a wall across it that leaves 1.5 m.
python3 - <<'PYTHON'
def box(lo, hi):
    x, y, z = zip(lo, hi)
    c = [(x[i & 1], y[i >> 1 & 1], z[i >> 2]) for i in range(8)]
    return [tuple(c[i] for i in q) for q in ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))]
squares = box((0.05, 0.05, 0.05), (6.05, 4.05, 2.45))
squares.append(((3.05, 0.05, 0.05), (3.05, 2.55, 0.05), (3.05, 2.55, 2.45), (3.05, 0.05, 2.45)))
def obj(name, squares, put):
    with open(name, "w") as out:
        for n, square in enumerate(squares):
            for p in square:
                out.write("v %.3f %.3f %.3f\n" % put(*p))
            out.write("f %d %d %d %d\n" % tuple(4 * n + k + 1 for k in range(4)))
obj("room.obj", squares, lambda x, y, z: (x, y, z))
obj("mm.obj", squares, lambda x, y, z: (1000 * x, 1000 * z, -1000 * y))
obj("roofless.obj", squares[:1] + squares[2:], lambda x, y, z: (x, y, z))
with open("room.csv", "w") as out:  # 4 cm apart along both edges of each square
    out.write("x_m,y_m,z_m\n")
    for a, b, _, d in squares:
        for i in range(161):
            for j in range(161):
                p = [a[k] + i / 160 * (b[k] - a[k]) + j / 160 * (d[k] - a[k]) for k in range(3)]
                out.write("%.6f,%.6f,%.6f\n" % tuple(p))
PYTHON
air=(--free-from 1,1,1.2)
"$backwash" map convert room.obj "${air[@]}" -o room.bt --json >room.json
"$backwash" map convert mm.obj --scale 0.001 --up y "${air[@]}" -o mm.bt >mm.txt
"$backwash" map convert room.csv "${air[@]}" -o cloud.bt --json >cloud.json
cmp room.bt mm.bt || die "in millimetres with y up it is another room"
cmp room.bt cloud.bt || die "as a dense cloud it is another room"
"$backwash" map info room.bt --vehicle builtin:quad-5in --out room.svg --json >info.json
grep -q '<svg' room.svg || die "the picture is no SVG"
"$backwash" map info room.bt --vehicle builtin:quad-5in | grep -q '^flyable  *yes: 1 regions' || die "the room is not told to be flyable"
"$backwash" plan --map room.bt --model builtin:quad-5in --vehicle builtin:quad-5in --start 1,1,1.2 --goal 5,1,1.2 --json >plan.json

# Mended: cut in two, without the half behind the wall; coarser; moved and turned; the air of a hole is told.
"$backwash" map convert room.bt --crop 0,0,0,3.1,4.1,2.5 -o half.bt --json >half.json
"$backwash" map convert room.bt --resolution 0.2 -o coarse.bt --json >coarse.json
"$backwash" map convert room.bt --rotate 1.570796,0,0 --origin 10,-20,0 -o turned.bt --json >turned.json
"$backwash" map convert turned.bt --rotate -1.570796,0,0 --origin 20,10,0 -o back.bt >/dev/null
cmp room.bt back.bt || die "turned there and back it is another room"
"$backwash" map convert roofless.obj "${air[@]}" -o roofless.bt --json >roofless.json
"$backwash" map convert room.obj --crop -1,-1,-1,7,5,3.5 -o unseen.bt --json >unseen.json
# A scan of one wall frees the rays to it and no more; of a thin cloud single points are no wall.
printf 'x_m,y_m,z_m,sensor_x_m,sensor_y_m,sensor_z_m\n2.05,0.05,0.05,0.05,0.05,0.05\n0.05,1.05,0.05,0.05,0.05,0.05\nnan,0,0,0,0,0\n' >scan.csv
"$backwash" map convert scan.csv -o scan.bt --json >scan.json
printf 'x,y,z\n1.01,1.01,1.01\n1.02,1.02,1.02\n1.55,1.01,1.01\n' >thin.csv
"$backwash" map convert thin.csv --points-least 2 --sensor 0.05,1.05,1.05 -o thin.bt --json >thin.json

python3 - <<'PYTHON'
import json
def load(name):
    return json.load(open(name + ".json"))
room, info, plan = load("room"), load("info"), load("plan")
free = 59 * 39 * 23 - 25 * 23  # between walls of one voxel, less the wall across
walls = 61 * 41 * 25 - 59 * 39 * 23 + 25 * 23
assert (room["kind"], room["triangles"], room["points_not_finite"]) == ("mesh", 14, 0), room
assert (room["free_voxels"], room["occupied_voxels"], room["unknown_voxels"]) == (free, walls, 0), room
assert room["freed_voxels"] == free and room["edges"] == [] and room["notes"] == [], room
assert (load("cloud")["kind"], load("cloud")["points"]) == ("cloud", 7 * 161 * 161)
for name in ("resolution_m", "size", "free_voxels", "occupied_voxels", "unknown_voxels", "open_m2"):
    assert info[name] == room[name], name
assert info["size"] == [61, 41, 25] and info["open_m2"] == 0 and abs(info["free_m3"] - free / 1000) < 1e-9, info
assert max(abs(a - b) for a, b in zip(info["low"] + info["high"], [0, 0, 0, 6.1, 4.1, 2.5])) < 1e-9, info
assert info["flyable"] and info["regions"] == 1 and 0 < info["hover_safe_voxels"] < free, info
assert all(l < w < h for l, w, h in zip(info["largest"]["low"], info["largest"]["widest"]["p"], info["largest"]["high"])), info
assert plan["status"] == "ok", plan
across = min(plan["trajectory"], key=lambda s: abs(s["p"][0] - 3.05))["p"]
assert 2.65 < across[1] < 3.95, f"the plan crosses the wall at {across}"
half = load("half")
assert half["size"] == [31, 41, 25] and half["free_voxels"] == 29 * 39 * 23 + 14 * 23 and half["kind"] == "octomap", half
coarse = load("coarse")  # pairs of voxels; the last pair along x and y is half unknown, the wall's own
assert coarse["size"] == [31, 21, 13] and coarse["resolution_m"] == 0.2, coarse
assert coarse["free_voxels"] == 29 * 19 * 11 - 12 * 11, coarse
turned = load("turned")
assert turned["free_voxels"] == free and turned["size"] == [41, 61, 25], turned
assert [e["side"] for e in load("roofless")["edges"]] == ["+z"] and "the free space reaches the map's edge at +z" in load("roofless")["notes"][0]
unseen = load("unseen")
assert unseen["free_voxels"] == 0 and unseen["unknown_voxels"] == 80 * 60 * 45 - walls and "nothing is free" in unseen["notes"][0], unseen
scan = load("scan")
assert (scan["occupied_voxels"], scan["free_voxels"], scan["points_not_finite"]) == (2, 29, 1), scan
assert "1 points without finite coordinates were left out, the first is point 3" in scan["notes"][0], scan
thin = load("thin")
assert thin["occupied_voxels"] == 1 and thin["free_voxels"] == 14, thin
PYTHON
grep -q '^14 triangles written to mm.bt' mm.txt || die "mm.txt: $(<mm.txt)"

# Files that people have (shared/data/field): a wall whose faces name texture coordinates that are not there stands.
field=$here/../../../shared/data/field
if [[ ! -d $field ]]; then
  echo "not tried: $field is not there"
  exit 0
fi
for name in two_rooms_ok two_rooms_wall_lost; do
  "$backwash" map convert "$field/$name.obj" --free-from 2,2,1.5 --free-from 6,2,1.5 -o $name.bt >/dev/null
done
cmp two_rooms_ok.bt two_rooms_wall_lost.bt || die "without vt lines it is another map"
through=0
"$backwash" plan --map two_rooms_wall_lost.bt --model builtin:quad-5in --vehicle builtin:quad-5in --start 2,2,1.5 --goal 6,2,1.5 >/dev/null 2>&1 || through=$?
[[ $through == 69 ]] || die "a plan through the wall: exit $through"
"$backwash" map convert "$field/k_vt_after_faces.obj" -o box.bt | grep -q '^12 triangles written' || die "k_vt_after_faces.obj has 12 triangles"
"$backwash" map info "$field/color.bt" | grep -q '^occupied    7568 voxels' || die "color.bt has 7568 occupied voxels"
