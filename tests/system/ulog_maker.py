# SPDX-License-Identifier: BSD-3-Clause
"""Writes a ULog (docs.px4.io, ULog File Format) of what an autopilot said over its link, as a raw log of backwashd has it."""
import struct

import raw_log

LOCAL_POSITION, ATTITUDE_QUATERNION = 32, 31
TOPICS = [(LOCAL_POSITION, "vehicle_local_position", "float x;float y;float z;float vx;float vy;float vz;", "<I6f", "<Q6f"),
          (ATTITUDE_QUATERNION, "vehicle_attitude", "float[4] q;", "<I4f", "<Q4f")]


def said(path, message):
    """Reception (s) and members of each such message: time since the autopilot's start in ms, then floats."""
    layout = next(row[3] for row in TOPICS if row[0] == message)
    for t, kind, body in raw_log.records(path):
        if kind == raw_log.FRAME_IN and body[0] == 0xFD and raw_log.message_id(body) == message:
            yield t, struct.unpack_from(layout, body[10:10 + body[1]] + bytes(64))


def write(path, raw, later_ms=0, north_m=0):
    """`later_ms`, `north_m`: what another flight has otherwise."""
    def message(kind, content):
        return struct.pack("<Hc", len(content), kind) + content

    rows = sorted((ms, number, layout, values) for number, (id_, _, _, _, layout) in enumerate(TOPICS) for _, (ms, *values) in said(raw, id_))
    with open(path, "wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
        for _, name, members, _, _ in TOPICS:
            file.write(message(b"F", f"{name}:uint64_t timestamp;{members}".encode()))
        for number, (_, name, _, _, _) in enumerate(TOPICS):
            file.write(message(b"A", struct.pack("<BH", 0, number) + name.encode()))
        for ms, number, layout, values in rows:
            file.write(message(b"D", struct.pack("<H", number) + struct.pack(layout, 1000 * (ms + later_ms), values[0] + north_m * (number == 0), *values[1:])))
