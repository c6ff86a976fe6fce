#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Files with bytes lost, overwritten, doubled and cut, a hundred of each format: what is read is what was left, or its share is told, or the
# file is refused by its name. What was left an own reader of the format says. Of bytes that no count and no checksum covers, the
# result need only hold what they say now.
#   mutilated.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" <<'PYTHON'
import csv, json, math, pathlib, random, re, struct, subprocess, sys

backwash = sys.argv[1]
random.seed(53)
CORNERS = [(x, y, z) for x in (0.0, 4.0) for y in (0.0, 3.0) for z in (0.0, 2.0)]
FACES = [(0, 1, 3), (0, 3, 2), (4, 7, 5), (4, 6, 7), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)] * 5


def run(*words):
    ran = subprocess.run([backwash, *words], capture_output=True, text=True, errors="replace", timeout=60)
    return ran.returncode, ran.stdout, ran.stderr


def hurt(whole, first=0):
    """One to four places of up to 40 bytes, behind `first`."""
    data = bytearray(whole)
    way = random.choice(["removed", "zeros", "noise", "inserted", "twice", "cut"])
    for _ in range(1 if way == "cut" else random.randint(1, 4)):
        at = random.randrange(first, len(data))
        size = min(random.randint(1, 40), len(data) - at)
        part = bytes(data[at : at + size])
        new = {"removed": b"", "zeros": bytes(size), "noise": random.randbytes(size), "inserted": random.randbytes(size) + part, "twice": part * 2,
               "cut": b""}[way]
        data[at : len(data) if way == "cut" else at + size] = new
        if not data[first:]:
            break
    return bytes(data), way


def floats(words):
    return [float(w) for w in words]


def obj_left(data):
    """Corners and faces of an OBJ, by its lines; None: something in it is no statement."""
    places, faces = 0, 0
    for line in data.decode("latin-1").replace("\r\n", "\n").split("\n"):
        words = line.split("#")[0].split()
        if words[:1] == ["v"]:
            floats(words[1:])
            places += 1
        elif words[:1] == ["f"]:
            faces += len(words) - 3
        elif words:
            return None
    return places, faces


def ply_left(data):
    head, body = data.split(b"end_header\n", 1)
    counts = [int(n) for n in re.findall(rb"(?m)^element \w+ (\d+)$", head)]
    size = counts[0] * 12
    for _ in range(counts[1]):
        size += 1 + 4 * body[size]
    return (counts[0], counts[1]) if size == len(body) else None


def stl_left(data):
    count = struct.unpack_from("<I", data, 80)[0]
    return (None, count) if len(data) == 84 + 50 * count else None


def ot_left(data):
    """Nodes of a .bt tree, as its bytes have them, if they are all of the bytes and as many as it says."""
    head, body = data.split(b"data\n", 1)
    said, seen, at, open_nodes = int(re.search(rb"(?m)^size (\d+)$", head)[1]), 1, 0, 1
    while open_nodes:
        bits = struct.unpack_from("<H", body, at)[0]
        at += 2
        kinds = [bits >> 2 * k & 3 for k in range(8)]
        seen += sum(k != 0 for k in kinds)
        open_nodes += sum(k == 3 for k in kinds) - 1
    return (None, None) if at == len(body) and seen == said else None


formats = {
    "room.obj": ("".join("v %g %g %g\n" % c for c in CORNERS) + "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in FACES)).encode(),
    "room.ply": (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(CORNERS)}\nproperty float x\nproperty float y\nproperty float z\n"
                 f"element face {len(FACES)}\nproperty list uchar int vertex_indices\nend_header\n").encode()
    + b"".join(struct.pack("<3f", *c) for c in CORNERS) + b"".join(struct.pack("<B3i", 3, *f) for f in FACES),
    "room.stl": bytes(80) + struct.pack("<I", len(FACES)) + b"".join(struct.pack("<12fH", 0, 0, 1, *(x for i in f for x in CORNERS[i]), 0) for f in FACES),
}
places = b"".join(struct.pack("<3f", *c) for c in CORNERS)
indices = b"".join(struct.pack("<3H", *f) for f in FACES)
scene = json.dumps({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                    "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(CORNERS), "type": "VEC3", "min": [0, 0, 0], "max": [4, 3, 2]},
                                  {"bufferView": 1, "componentType": 5123, "count": 3 * len(FACES), "type": "SCALAR"}],
                    "bufferViews": [{"buffer": 0, "byteLength": len(places)}, {"buffer": 0, "byteOffset": len(places), "byteLength": len(indices)}],
                    "buffers": [{"byteLength": len(places + indices)}]}).encode()
scene += b" " * (-len(scene) % 4)
binary = places + indices + bytes(-len(indices) % 4)
formats["room.glb"] = (struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(scene) + 8 + len(binary)) + struct.pack("<I4s", len(scene), b"JSON") + scene
                       + struct.pack("<I4s", len(binary), b"BIN\0") + binary)
own = {"room.obj": obj_left, "room.ply": ply_left, "room.stl": stl_left, "room.bt": ot_left}
pathlib.Path("whole.obj").write_bytes(formats["room.obj"])
assert run("map", "convert", "whole.obj", "-o", "room.bt", "--free-from", "2,1.5,1", "--quiet")[0] in (0, 64)
if not pathlib.Path("room.bt").exists():
    code, _, err = run("map", "convert", "whole.obj", "-o", "room.bt", "--free-from", "2,1.5,1")
    assert code == 0, err
formats["room.bt"] = pathlib.Path("room.bt").read_bytes()
for name, whole in formats.items():
    seen = {"read": 0, "refused": 0}
    for n in range(100):
        data, way = hurt(whole)
        if data == whole:
            continue
        file = "hurt" + pathlib.Path(name).suffix
        pathlib.Path(file).write_bytes(data)
        code, out, err = run("map", "convert", file, "-o", "made.bt", "--force", "--json") if name != "room.bt" else run("map", "info", file, "--json")
        which = f"{name} {n} ({way}): {code} {err}{out[:200]}"
        if code != 0:
            assert code in (65, 66, 69) and file in err and err.count("\n") == 1, which
            seen["refused"] += 1
            continue
        seen["read"] += 1
        try:
            left = own[name](data) if name in own else None
        except (ValueError, IndexError, struct.error, TypeError):
            left = None
        said = json.loads(out)
        if name == "room.glb":  # its lengths stand in it: what is lost or added breaks them
            assert way in ("zeros", "noise") and said["triangles"] == len(FACES), which
            continue
        assert left is not None, "silent: " + which
        if left[1] is not None:
            assert said["triangles"] == left[1], f"silent: {left} " + which
    print(name, seen)
    assert seen["refused"] > 10, name

# Tables: rows written and rows told are all rows that the damaged table has.
table = "t,x,y,z\n" + "".join("%.2f,%.6f,%.6f,%.6f\n" % (t := 0.01 * k, math.sin(t), math.sin(1.3 * t), 1 + 0.2 * math.sin(2 * t)) for k in range(600))
pathlib.Path("map.toml").write_text('[frame]\nworld = "enu"\n[columns]\nt_s = "t"\nx_m = "x"\ny_m = "y"\nz_m = "z"\n')
seen = {"read": 0, "refused": 0}
for n in range(100):
    data, way = hurt(table.encode(), 8)
    pathlib.Path("hurt.csv").write_bytes(data)
    code, out, err = run("import", "--map-columns", "map.toml", "hurt.csv", "-o", "logs", "--force", "--json")
    which = f"table {n} ({way}): {code} {err}{out}"
    if code != 0:
        assert code == 65 and "hurt.csv:" in err and err.count("\n") == 1, which
        seen["refused"] += 1
        continue
    seen["read"] += 1
    rows = [line.split(",") for line in data.decode("latin-1").split("\n")[1:] if line.strip(' \r\t"')]
    left = [[float(c) if c.strip() not in ("", "nan") else math.nan for c in r] for r in rows]
    written = {round(float(r["t_s"]), 6): float(r["x_m"]) for r in csv.DictReader(open("logs/hurt.csv"))}
    for t, x in written.items():
        assert any(abs(r[0] - left[0][0] - t) < 1e-6 and abs(r[1] - x) < 1e-9 for r in left), f"invented {t}: " + which
    told = sum(int(k) for k in re.findall(r"(\d+) of \d+ rows \(", out))
    assert len(written) + told + 14 >= len(left), f"silent: {len(written)} of {len(left)}, {told} told: " + which
print("table", seen)

# A telemetry log is none that is read: its name, and what makes it readable, whatever is lost of it.
frame = struct.pack(">Q", 1_700_000_000_000_000) + bytes([0xFE, 9, 0, 1, 1, 0]) + bytes(9) + b"\1\2"
for n in range(100):
    data, way = hurt(frame * 40)
    pathlib.Path("hurt.tlog").write_bytes(data)
    code, out, err = run("import", "hurt.tlog", "-o", "logs", "--force")
    assert code in (64, 65, 66) and err.count("\n") == 1 and "hurt.tlog" in err, f"tlog {n} ({way}): {code} {err}"
PYTHON
