# SPDX-License-Identifier: BSD-3-Clause
"""Reads a raw log of backwashd (core/log/raw/raw_log.hpp) and the bench's record of the wire, for the system tests."""
import collections
import csv
import struct

MAGIC, MCAP, TOPIC = b"backwash raw log 3\n", b"\x89MCAP0\r\n", b"/backwash/raw_log"
ODOMETRY, FRAME_IN, FRAME_OUT, TICK, LOST, SCAN, WORLD, FAILURE = 2, 6, 7, 8, 13, 14, 15, 16
MODES = ["passive", "enabling", "tracking", "hold", "land", "quiet", "lifting"]
SETPOINT, HEARTBEAT, COMMAND, ODOMETRY_FRAME, TIMESYNC = 84, 0, 76, 331, 111

Tick = collections.namedtuple("Tick", "t number segment index mode reason sent judged inside missed compute_us lateness_us")


def records(path):
    """Of a log of the daemon, as it is now (MCAP) or was before: t (s), kind, content. What is cut short at its end is left out."""
    data = open(path, "rb").read()
    for at in raw_records(data) if data.startswith(MCAP) else old_records(data):
        t, kind, size = struct.unpack_from("<qII", data, at)
        yield t * 1e-9, kind, data[at + 16:at + 16 + size]


def old_records(data):
    assert data.startswith(MAGIC), data[:32]
    at = len(MAGIC)
    while at + 16 <= len(data):
        yield at
        at += 16 + struct.unpack_from("<I", data, at + 12)[0]


def raw_records(data):
    """Where those of the raw log begin in an MCAP file without compression."""
    at, raw = len(MCAP), None
    while at + 9 <= len(data):
        op, length = struct.unpack_from("<BQ", data, at)
        at += 9
        if op == 6:  # a chunk: its messages follow its head, its compression's name is empty
            at += 40
            continue
        if op == 4:
            size = struct.unpack_from("<I", data, at + 4)[0]
            raw = struct.unpack_from("<H", data, at)[0] if data[at + 8:at + 8 + size] == TOPIC else raw
        if op == 15 or at + length > len(data):
            return
        if op == 5 and struct.unpack_from("<H", data, at)[0] == raw:
            yield at + 22 + 16  # behind the message's head and that of its octets
        at += length


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
