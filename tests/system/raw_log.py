# SPDX-License-Identifier: BSD-3-Clause
"""Reads a raw log of backwashd (core/log/raw_log.hpp) and the bench's record of the wire, for the system tests."""
import collections
import csv
import struct

MAGIC = b"backwash raw log 3\n"
ODOMETRY, FRAME_IN, FRAME_OUT, TICK, LOST, SCAN, WORLD, FAILURE = 2, 6, 7, 8, 13, 14, 15, 16
MODES = ["passive", "enabling", "tracking", "hold", "land", "quiet", "lifting"]
SETPOINT, HEARTBEAT, COMMAND, ODOMETRY_FRAME, TIMESYNC = 84, 0, 76, 331, 111

Tick = collections.namedtuple("Tick", "t number segment index mode reason sent judged inside missed compute_us lateness_us")


def records(path):
    data = open(path, "rb").read()
    assert data.startswith(MAGIC), path
    at = len(MAGIC)
    while at + 16 <= len(data):
        t, kind, size = struct.unpack_from("<qII", data, at)
        yield t * 1e-9, kind, data[at + 16:at + 16 + size]
        at += 16 + size


def ticks(path):
    for t, kind, body in records(path):
        if kind == TICK:
            number, segment, index, mode, reason, sent, judged, inside, missed, compute, late = struct.unpack_from(
                "<3Q6I2f", body)
            yield Tick(t, number, segment, index, MODES[mode], reason, sent, judged, inside, missed, compute, late)


def message_id(frame):
    return frame[7] | frame[8] << 8 | frame[9] << 16


def times(path, kind, wanted=None):
    return [t for t, k, body in records(path) if k == kind and (wanted is None or message_id(body) == wanted)]


def lines(path, kind):
    return [(t, body.decode()) for t, k, body in records(path) if k == kind]


def wire(path):
    """Rows of what the flight controller received: t (s), id, type mask or None."""
    for row in csv.DictReader(open(path)):
        yield float(row["t_s"]), int(row["id"]), int(row["type_mask"]) if row["type_mask"] else None
