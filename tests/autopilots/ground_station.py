#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The autopilots' ground station: heartbeats each second, with `sticks` also sticks in the middle 20 times a second.

ground_station.py tcp|udp PORT [sticks]   where the autopilot listens on 127.0.0.1

Lines of standard input: `quiet` ends heartbeats and sticks, `sticks` the sticks alone, `set NAME VALUE` sets a parameter (ArduPilot).
"""
import os
import pathlib
import select
import socket
import struct
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
from mavlink_crc import crc  # noqa: E402

SYSTEM, COMPONENT = 255, 190
HEARTBEAT, PARAM_SET, MANUAL_CONTROL = (0, 50), (23, 168), (69, 243)  # id, CRC_EXTRA
GCS, NO_AUTOPILOT, ACTIVE, REAL32 = 6, 8, 4, 9


class Station:
    def __init__(self, transport, port):
        stream = transport == "tcp"
        self.line = socket.socket(socket.AF_INET, socket.SOCK_STREAM if stream else socket.SOCK_DGRAM)
        self.line.connect(("127.0.0.1", port))
        self.line.setblocking(False)
        self.sequence = 0

    def send(self, message, payload):
        number, extra = message
        head = struct.pack("<BBBBBBHB", len(payload), 0, 0, self.sequence, SYSTEM, COMPONENT, number, 0)
        self.sequence = (self.sequence + 1) % 256
        checksum = crc(head + payload + bytes([extra]))
        try:
            self.line.send(b"\xfd" + head + payload + struct.pack("<H", checksum))
            while self.line.recv(65536):  # nobody reads it, but it must not pile up
                pass
        except (BlockingIOError, ConnectionRefusedError):
            pass

    def heartbeat(self):
        self.send(HEARTBEAT, struct.pack("<IBBBBB", 0, GCS, NO_AUTOPILOT, 0, ACTIVE, 3))

    def sticks(self):  # x, y, r in the middle; z is the throttle, 0 to 1000
        self.send(MANUAL_CONTROL, struct.pack("<hhhhHB", 0, 0, 500, 0, 0, 1))

    def set(self, name, value):
        self.send(PARAM_SET, struct.pack("<fBB16sB", float(value), 1, 1, name.encode(), REAL32))


def main():
    station = Station(sys.argv[1], int(sys.argv[2]))
    every = {station.heartbeat: 1.0} | ({station.sticks: 0.05} if "sticks" in sys.argv[3:] else {})
    due = dict.fromkeys(every, 0.0)
    while True:
        if select.select([sys.stdin], [], [], 0.02)[0]:
            for line in os.read(sys.stdin.fileno(), 1024).decode().splitlines():
                verb, *words = line.split()
                if verb == "set":
                    station.set(*words)
                for silent in {"quiet": (station.heartbeat, station.sticks), "sticks": (station.sticks,)}.get(verb, ()):
                    due[silent] = float("inf")
        for send, period in every.items():
            if time.monotonic() >= due[send]:
                send()
                due[send] = time.monotonic() + period


if __name__ == "__main__":
    main()
