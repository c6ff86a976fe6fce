#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Clouds and poses as vehicles record them become the map of the same points placed by hand; what a scanner does not see, or sees of the
# vehicle itself, and who walks by, is in none; and clouds of which nobody says where they were seen from are refused.
#   map_clouds.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
PYTHONPATH=$here python3 - "$backwash" "$here/../../../shared/data/field" <<'PYTHON'
import json, pathlib, subprocess, sys
from recordings_maker import *

backwash, field = sys.argv[1], pathlib.Path(sys.argv[2])
SCANS, RAYS = 60, 400


def convert(file, *options, code=0):
    ran = subprocess.run([backwash, "map", "convert", str(file), "-o", "out.bt", "--force", "--json", *options], capture_output=True, text=True)
    assert ran.returncode == code, (file, options, ran.returncode, ran.stderr)
    return (json.loads(ran.stdout), pathlib.Path("out.bt").read_bytes()) if code == 0 else ran.stderr


def told(made, words):
    assert any(words in note for note in made["notes"]), (words, made["notes"])


def recorded(name, pose, cloud, more=lambda body: [], frame=lambda p, at, yaw: to_body(p, at, yaw), somebody=lambda n: None, scans=SCANS):
    """A recording, and a table of the points of it that are places, in the world as 32 bits of the body's frame give them."""
    made, rows = Recording(), ["x_m,y_m,z_m,sensor_x_m,sensor_y_m,sensor_z_m"]
    for n in range(scans):
        at, yaw = path(n * SCANS / scans)
        pose(made, 0.1 * n, at, yaw)
        points = [frame(p, at, yaw) for p in seen(at, RAYS, n, somebody(n))]
        cloud(made, 0.1 * n, points + more(n))
        for p in points:
            single = struct.unpack("<3f", struct.pack("<3f", *p))
            world = to_world(single, at, yaw) if frame(p, at, yaw) != p else single
            rows.append(",".join(map(repr, (*world, *at))))
    made.write(name + ".mcap")
    open(name + ".csv", "w").write("\n".join(rows) + "\n")
    return name + ".mcap"


cloud = lambda made, t, points: made.cloud(t, points)
named = lambda made, t, at, yaw: made.odometry(t, at, yaw)
recorded("named", named, cloud)
_, room = convert("named.csv")

# Whoever says where the body was: the same map.
ways = {
    "vins": lambda made, t, at, yaw: made.odometry(t, at, yaw, child="world"),
    "no-child": lambda made, t, at, yaw: made.odometry(t, at, yaw, child=""),
    "mavros": lambda made, t, at, yaw: made.pose_stamped(t, at, yaw),
    "vrpn": lambda made, t, at, yaw: made.pose_stamped(t, at, yaw, "/vrpn_client_node/quad/pose", "world"),
    "px4": lambda made, t, at, yaw: made.px4_odometry(t, at, yaw),
}
for name, pose in ways.items():
    made, bytes_ = convert(recorded(name, pose, cloud))
    same = bytes_ == room
    assert same or name == "px4", f"{name}: another map than of the points placed by hand"
    if name == "px4":  # its place has 32 bits: some points are in the voxel beside
        wanted = json.loads(subprocess.run([backwash, "map", "info", "out.bt", "--json"], capture_output=True, text=True).stdout)
        assert wanted["size"] == [61, 41, 25] and abs(wanted["free_m3"] - 6 * 4 * 2.4) < 6, wanted
    told(made, "which name no body, are those of frame 'body'")
made, bytes_ = convert(recorded("livox", named, lambda made, t, points: made.livox(t, points)))
assert bytes_ == room, "Livox' points are other points"

# No returns and the vehicle's own arms.
arms = lambda n: [(0, 0, 0)] * 5 + [(math.nan,) * 3] * 3 + [(0.11 * x, 0.11 * y, 0.0) for x in (-1, 1) for y in (-1, 1)]
recorded("arms", named, cloud, arms)
made, bytes_ = convert("arms.mcap", "--vehicle", "builtin:quad-5in")
assert bytes_ == room, "with the vehicle's own arms left out it is another room"
told(made, f"{4 * SCANS} points on the vehicle itself were left out")
told(made, f"{5 * SCANS} points at (0, 0, 0) are no returns and were left out")
assert made["points_not_finite"] == 3 * SCANS, made
assert convert("arms.mcap", "--body-radius", "0.16")[1] == room and convert("arms.mcap", "--body-radius", "0.1")[1] != room
assert "number above 0" in convert("arms.mcap", "--body-radius", "-1", code=64)

# Who walks through the room for three seconds, or stands there, is not in the map.
for name, somebody in {"walks": lambda n: (3.0, 0.6 + 0.1 * n) if n < 30 else None, "stands": lambda n: (4.6, 1.1) if 20 <= n < 50 else None}.items():
    made, _ = convert(recorded(name, named, cloud, somebody=somebody, scans=150))
    told(made, "later scans")
    plan = subprocess.run([backwash, "plan", "--map", "out.bt", "--model", "builtin:quad-5in", "--vehicle", "builtin:quad-5in",
                           "--start", "1.5,1.1,1.2", "--goal", "4.6,1.1,1.2", "--json"], capture_output=True, text=True)
    assert plan.returncode == 0, (name, plan.stderr)

# Nobody says where the clouds were seen from.
silent = lambda made, t, at, yaw: None
assert "nothing says where frame 'body' was" in convert(recorded("silent", silent, cloud), code=65)
two = lambda made, t, at, yaw: [made.pose_stamped(t, at, yaw, topic) for topic in ("/vrpn/quad/pose", "/vrpn/wand/pose")]
assert "and not several" in convert(recorded("two", two, cloud), code=65)
other = lambda made, t, at, yaw: made.odometry(t, at, yaw, child="base_link")
assert "nothing says where frame 'body' was" in convert(recorded("other", other, cloud), code=65)
mount = lambda made: made.transform(0, "base_link", "body", (0, 0, 0), 0, "/tf_static")
mounted = lambda made, t, at, yaw: mount(made)
assert "nothing says where frame 'base_link' was" in convert(recorded("mounted", mounted, cloud), code=65)
joint = lambda made, t, at, yaw: made.transform(t, "base_link", "body", (0, 0, 0), 0)
assert "nothing says where frame 'base_link' was" in convert(recorded("joint", joint, cloud), code=65)
both = lambda made, t, at, yaw: (mount(made), made.pose_stamped(t, at, yaw))
assert convert(recorded("both", both, cloud))[1] == room
moved = lambda made, t, at, yaw: (mount(made), made.transform(t, "quad/odom", "base_link", at, yaw))
assert convert(recorded("moved", moved, cloud))[1] == room
still = lambda p, at, yaw: p
made, _ = convert(recorded("fixed", silent, lambda made, t, points: made.cloud(t, points, "map"), frame=still))
told(made, "nothing says where they were seen from")
short = recorded("short", named, lambda made, t, points: made.livox(t, points, stated=len(points) + 1))
assert f"says {RAYS + 1} points and has {RAYS}" in convert(short, code=65)

# Files that people have.
if not field.is_dir():
    print(f"not tried: {field} is not there")
    sys.exit()
for name, options in {"bag_H_vins": [], "bag_I_arms": ["--body-radius", "0.4"]}.items():
    convert(field / (name + ".mcap"), *options)
    plan = subprocess.run([backwash, "plan", "--map", "out.bt", "--model", "builtin:quad-5in", "--vehicle", "builtin:quad-5in",
                           "--start", "1.5,2,1.2", "--goal", "4.5,2,1.2", "--json"], capture_output=True, text=True)
    assert plan.returncode == 0 and abs(json.loads(plan.stdout)["metrics"]["min_clearance_m"] - 0.946) < 0.001, (name, plan)
PYTHON
