# SPDX-License-Identifier: BSD-3-Clause
"""Small recordings of ROS 2 for tests: MCAP without chunks, CDR by hand. What is seen is a closed room, from a body that moves.

Points are placed in the world by the tests' own arithmetic, so that a table of them is what a reader should make of the recording.
"""
import math
import random
import struct

LOW, HIGH = (0.05, 0.05, 0.05), (6.05, 4.05, 2.45)


class Cdr:
    """Little-endian CDR: numbers begin at multiples of their size, counted behind the head of four bytes."""

    def __init__(self):
        self.bytes = b""

    def put(self, kind, *values):
        size = struct.calcsize(kind)
        for value in values:
            self.bytes += bytes(-len(self.bytes) % size) + struct.pack("<" + kind, value)
        return self

    def text(self, text):
        self.put("I", len(text) + 1)
        self.bytes += text.encode() + b"\0"
        return self

    def header(self, t, frame):
        return self.put("i", 1000 + math.floor(t)).put("I", round((t - math.floor(t)) * 1e9)).text(frame)

    def pose(self, p, yaw):
        return self.put("d", *p, 0, 0, math.sin(yaw / 2), math.cos(yaw / 2))


class Recording:
    def __init__(self):
        self.records, self.channels = [], {}
        self.record(1, struct.pack("<I", 4) + b"ros2" + struct.pack("<I", 4) + b"test")

    def record(self, kind, content):
        self.records.append(struct.pack("<BQ", kind, len(content)) + content)

    def say(self, topic, kind, cdr, t):
        text = lambda s: struct.pack("<I", len(s)) + s.encode()
        if topic not in self.channels:
            n = self.channels[topic] = len(self.channels) + 1
            self.record(3, struct.pack("<H", n) + text(kind) + text("ros2msg") + text(""))
            self.record(4, struct.pack("<HH", n, n) + text(topic) + text("cdr") + struct.pack("<I", 0))
        ns = round((1000 + t) * 1e9)
        self.record(5, struct.pack("<HIQQ", self.channels[topic], 0, ns, ns) + b"\0\1\0\0" + cdr.bytes)

    def odometry(self, t, p, yaw, frame="world", child="body", topic="/odometry"):
        cdr = Cdr().header(t, frame).text(child).pose(p, yaw).put("d", *[0] * 36, *[0] * 6, *[0] * 36)
        self.say(topic, "nav_msgs/msg/Odometry", cdr, t)

    def transform(self, t, parent, child, p, yaw, topic="/tf"):
        self.say(topic, "tf2_msgs/msg/TFMessage", Cdr().put("I", 1).header(t, parent).text(child).pose(p, yaw), t)

    def pose_stamped(self, t, p, yaw, topic="/mavros/local_position/pose", frame="map"):
        self.say(topic, "geometry_msgs/msg/PoseStamped", Cdr().header(t, frame).pose(p, yaw), t)

    def px4_odometry(self, t, p, yaw):
        us = round((1000 + t) * 1e6)
        cdr = Cdr().put("Q", us + 4000, us).put("B", 1).put("f", p[0], -p[1], -p[2])  # north, east, down
        cdr.put("f", math.cos(yaw / 2), 0, 0, -math.sin(yaw / 2)).put("B", 1).put("f", *[0] * 15).put("B", 0).put("b", 0)
        self.say("/fmu/out/vehicle_odometry", "px4_msgs/msg/VehicleOdometry", cdr, t)

    def cloud(self, t, points, frame="body", topic="/points"):
        cdr = Cdr().header(t, frame).put("I", 1, len(points), 3)
        for n, name in enumerate("xyz"):
            cdr.text(name).put("I", 4 * n).put("B", 7).put("I", 1)
        cdr.put("B", 0).put("I", 12, 12 * len(points), 12 * len(points))
        cdr.bytes += b"".join(struct.pack("<3f", *p) for p in points)
        self.say(topic, "sensor_msgs/msg/PointCloud2", cdr.put("B", 0), t)

    def livox(self, t, points, frame="body", stated=None):
        cdr = Cdr().header(t, frame).put("Q", 0).put("I", len(points) if stated is None else stated).put("B", 0, 0, 0, 0).put("I", len(points))
        for n, p in enumerate(points):
            cdr.put("I", n).put("f", *p).put("B", 10, 0, 1)
        self.say("/livox/lidar", "livox_ros_driver2/msg/CustomMsg", cdr, t)

    def write(self, path):
        magic = b"\x89MCAP0\r\n"
        self.record(15, struct.pack("<I", 0))  # the data end
        self.record(2, struct.pack("<QQI", 0, 0, 0))
        open(path, "wb").write(magic + b"".join(self.records) + magic)


def path(n):
    """Where the body is at scan n of 60, and its yaw."""
    return (1.03 + 0.06 * n, 2.02, 1.21), 0.02 * n


def to_body(p, at, yaw):
    d = [a - b for a, b in zip(p, at)]
    return (math.cos(yaw) * d[0] + math.sin(yaw) * d[1], math.cos(yaw) * d[1] - math.sin(yaw) * d[0], d[2])


def to_world(p, at, yaw):
    return (at[0] + math.cos(yaw) * p[0] - math.sin(yaw) * p[1], at[1] + math.sin(yaw) * p[0] + math.cos(yaw) * p[1], at[2] + p[2])


def seen(at, rays, seed, somebody=None):
    """Where rays from a place meet the room, or an upright cylinder of 0.25 m."""
    draw, points = random.Random(seed), []
    for _ in range(rays):
        w = [draw.gauss(0, 1) for _ in range(3)]
        length = math.sqrt(sum(v * v for v in w))
        w = [v / length for v in w]
        r = min(((HIGH[k] if w[k] > 0 else LOW[k]) - at[k]) / w[k] for k in range(3))
        if somebody:
            d = [at[k] - somebody[k] for k in range(2)]
            a, b, c = w[0] ** 2 + w[1] ** 2, w[0] * d[0] + w[1] * d[1], d[0] ** 2 + d[1] ** 2 - 0.0625
            if b * b > a * c and b < 0:
                r = min(r, (-b - math.sqrt(b * b - a * c)) / a)
        points.append(tuple(at[k] + r * w[k] for k in range(3)))
    return points
