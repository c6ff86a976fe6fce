#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stands in the line between an autopilot and the daemon; what passes while it is cut is lost, as on a serial line.

relay.py tcp AUTOPILOT LISTEN [BAUD]   the autopilot listens on the port AUTOPILOT of 127.0.0.1, the daemon connects to LISTEN
relay.py udp HEARD TOLD [BAUD]         the autopilot sends to the port HEARD, the daemon listens on TOLD

BAUD: what the daemon sends passes at this rate (8N1), however much waits. Lines of standard input: cut, go; late SECONDS, each way
from then on; lose SHARE, of bytes each way; streams: a ground station on the line asks for none.
"""
import collections
import math
import os
import pathlib
import random
import select
import socket
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
from mavlink_crc import crc  # noqa: E402

HERE = "127.0.0.1"


def tcp(autopilot_port, listen_port):
    waiting = socket.create_server((HERE, listen_port))
    daemon, _ = waiting.accept()
    autopilot = socket.create_connection((HERE, autopilot_port))
    for end in (daemon, autopilot):
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return autopilot, daemon, daemon.sendall, autopilot.sendall


def udp(heard_port, told_port):
    autopilot = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    autopilot.bind((HERE, heard_port))
    _, sender = autopilot.recvfrom(4096)
    daemon = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    return autopilot, daemon, lambda data: daemon.sendto(data, (HERE, told_port)), lambda data: autopilot.sendto(data, sender)


class Line:
    """Hands on what it is given once its last bit would have arrived, `late` after that; each byte is lost with the chance `lost`."""

    def __init__(self, send, baud=math.inf):
        self.send, self.seconds_a_byte, self.late, self.lost = send, 10 / baud, 0.0, 0.0
        self.free, self.waiting = 0.0, collections.deque()

    def take(self, data):
        if self.lost:
            data = bytes(byte for byte in data if random.random() >= self.lost)
        now = time.monotonic()
        self.free = max(self.free, now) + len(data) * self.seconds_a_byte
        self.waiting.append((self.free + self.late, data))

    def hand_on(self):
        """The time until something is due again, s."""
        while self.waiting and self.waiting[0][0] <= time.monotonic():
            self.send(self.waiting.popleft()[1])
        return max(0.0, self.waiting[0][0] - time.monotonic()) if self.waiting else math.inf


def no_streams():
    """REQUEST_DATA_STREAM of a ground station: all of them, never."""
    payload = struct.pack("<HBBBB", 0, 1, 1, 0, 0)
    head = struct.pack("<BBBBBBHB", len(payload), 0, 0, 0, 255, 190, 66, 0)
    return b"\xfd" + head + payload + struct.pack("<H", crc(head + payload + bytes([148])))


def main():
    autopilot, daemon, to_daemon, to_autopilot = {"tcp": tcp, "udp": udp}[sys.argv[1]](int(sys.argv[2]), int(sys.argv[3]))
    ways = {autopilot: Line(to_daemon), daemon: Line(to_autopilot, *map(float, sys.argv[4:]))}
    whole = True
    while True:
        due = min(line.hand_on() for line in ways.values())
        for end in select.select([sys.stdin, *ways], [], [], due if due < math.inf else None)[0]:
            if end is sys.stdin:
                for words in map(str.split, os.read(sys.stdin.fileno(), 64).decode().splitlines()):
                    if words[0] in ("cut", "go"):
                        whole = words[0] == "go"
                    elif words[0] == "streams":
                        to_autopilot(no_streams())
                    else:
                        for line in ways.values():
                            setattr(line, {"late": "late", "lose": "lost"}[words[0]], float(words[1]))
                continue
            try:
                data = end.recv(4096)
            except ConnectionRefusedError:  # UDP: the daemon does not listen yet
                continue
            if not data and end.type == socket.SOCK_STREAM:
                return
            if whole:
                ways[end].take(data)


if __name__ == "__main__":
    main()
