# SPDX-License-Identifier: BSD-3-Clause
"""Writes raw logs of flights that were never flown (core/log/raw/raw_log.hpp), for the tests of `backwash report`."""
import struct

MODES = {"passive": 0, "enabling": 1, "tracking": 2, "hold": 3, "land": 4, "quiet": 5, "lifting": 6}
STARTED, SEGMENT_ACCEPTED, ODOMETRY_LOST, LANDED, LAND_REQUESTED, STOP_REQUESTED, AIR_ROUGHER = 0, 4, 6, 16, 18, 35, 46
MAP, COMMAND, ACK, TICK, SEGMENT, TICK_INPUT, LOST, SCAN, WORLD, FAILURE = 3, 4, 5, 8, 9, 11, 13, 14, 15, 16
AIR_CONSTANTS, AIR = 18, 19
CLASSES = ["free_air", "ground", "wall", "corner", "none"]
ARMED, LANDED_KNOWN, ON_GROUND = 1 << 4, 1 << 14, 1 << 15
GO_TO, LAND, RELEASE, STOP = 4, 6, 7, 8


class RawLog:
    """Records in their order, 20 ms a tick."""

    def __init__(self):
        self.bytes, self.t, self.number, self.segments, self.sequence = b"backwash raw log 3\n", 10**9, 0, 0, 0
        self.at, self.in_air = (0.0, 0.0, 0.0), False
        self.learnt = None  # of the air: class, factors, ln of the evidence and of the detector's

    def record(self, kind, body):
        self.bytes += struct.pack("<qII", self.t, kind, len(body)) + body

    def tick(self, mode, reason, segment=0, index=0, command=None, error=0.0, judged=None):
        """`error`: of the measured position along x; the set's half width is 0.1 m."""
        center = command or self.at
        self.at = (center[0] + error, center[1], center[2])
        judged = self.in_air and segment > 0 if judged is None else judged
        flags = (ARMED if self.in_air else 0) | LANDED_KNOWN | (0 if self.in_air else ON_GROUND)
        if self.learnt and self.in_air:
            where, factors, evidence, changed = self.learnt
            self.record(AIR, struct.pack("<Q3d2I8d", self.number, *[0.03] * 3, CLASSES.index(where), 0, *factors, evidence, changed, 1))
        self.record(TICK_INPUT, struct.pack("<5q2Q29d2i2IIf", *[self.t] * 5, 0, 0, *[0.0] * 29, 0, 0, flags, 0, 0, 0.0))
        self.record(TICK, struct.pack("<3Q6I5fI34d2I", self.number, segment, index, MODES[mode], reason, 0, judged,
                                      abs(error) <= 0.1, 0, 0, 0, 0 if segment else -1, 0, 0, 0, *self.at, 0, 0, 0, *center, *[0.0] * 7,
                                      *center, *[0.1] * 5, *[0.0] * 10, 0, 0))
        self.t, self.number = self.t + 20_000_000, self.number + 1

    def command(self, verb, place=(0, 0, 0), result=0, reason=""):
        self.sequence += 1
        x, y, z = place
        self.record(COMMAND, f"op@here 7 {self.sequence} verb {verb} ({x:.3f}, {y:.3f}, {z:.3f}) yaw 0 writer 1".encode())
        self.record(ACK, f"op@here {self.sequence} result {result}: {reason}".encode())

    def fly(self, to, ticks=50, until=None, mode="tracking", error=0.0):
        """A segment on a straight line from here; its first `until` commands are flown."""
        start = self.at
        line = [tuple(a + (b - a) * (k + 1) / ticks for a, b in zip(start, to)) for k in range(ticks)]
        self.segments += 1
        rows = b"".join(struct.pack("<10d", *p, *[0.0] * 7) for p in [start, *line])
        self.record(SEGMENT, struct.pack("<3Q9d", self.segments, 0, ticks, *start, *[0.0] * 6) + rows)
        self.in_air = True
        for k in range(until or ticks):
            self.tick(mode, SEGMENT_ACCEPTED, self.segments, k, line[k], error)
            self.at = line[k]

    def land(self):
        self.command(LAND)
        for _ in range(10):
            self.tick("land", LAND_REQUESTED)
        self.in_air = False
        self.at = (self.at[0], self.at[1], 0.0)
        for _ in range(5):
            self.tick("passive", LANDED)

    def wait(self, ticks=5):
        for _ in range(ticks):
            self.tick("passive", STARTED)

    def learns(self, start=(1.0,) * 5, alpha=0.01):
        self.record(AIR_CONSTANTS, struct.pack("<17d", *[1.0] * 11, alpha, *start))

    def free_cube(self):
        """A map that knows one thing: the cube from (-1.6, -1.6, -1.6) to the origin is free."""
        self.map(b"\x03\x00" + b"\x00\xc0" * 10 + b"\x00\x40")

    def map(self, octomap):
        """A map of 0.1 m that was accepted, as OctoMap's binary tree."""
        self.record(MAP, struct.pack("<dII", 0.1, 1, 1) + octomap)

    def window(self):
        """Both clouds of a mapper's window."""
        self.record(SCAN, b"free window of 500 voxels, 0 new voxels")
        self.record(SCAN, b"occupied window of 90 voxels, 7 new voxels")

    def write(self, path, most=None):
        with open(path, "wb") as file:
            file.write(self.bytes[:most])
