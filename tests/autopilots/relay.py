#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stands in the line between an autopilot and the daemon; what passes while it is cut is lost, as on a serial line.

relay.py tcp AUTOPILOT LISTEN [BAUD]   the autopilot listens on the port AUTOPILOT of 127.0.0.1, the daemon connects to LISTEN
relay.py udp HEARD TOLD [BAUD]         the autopilot sends to the port HEARD, the daemon listens on TOLD

BAUD: what the daemon sends passes at this rate (8N1), however much waits. Lines of standard input: cut, go.
"""
import collections
import os
import select
import socket
import sys
import time

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


class SlowLine:
    """Hands on what it is given once its last bit would have arrived."""

    def __init__(self, send, baud):
        self.send, self.seconds_a_byte = send, 10 / baud
        self.free, self.waiting = 0.0, collections.deque()

    def __call__(self, data):
        now = time.monotonic()
        self.free = max(self.free, now) + len(data) * self.seconds_a_byte
        self.waiting.append((self.free, data))

    def hand_on(self):
        """The time until something is due again, s."""
        while self.waiting and self.waiting[0][0] <= time.monotonic():
            self.send(self.waiting.popleft()[1])
        return max(0.0, self.waiting[0][0] - time.monotonic()) if self.waiting else None


def main():
    autopilot, daemon, to_daemon, to_autopilot = {"tcp": tcp, "udp": udp}[sys.argv[1]](int(sys.argv[2]), int(sys.argv[3]))
    slow = SlowLine(to_autopilot, float(sys.argv[4])) if len(sys.argv) > 4 else None
    ways = {autopilot: to_daemon, daemon: slow or to_autopilot}
    whole = True
    while True:
        for end in select.select([sys.stdin, *ways], [], [], slow.hand_on() if slow else None)[0]:
            if end is sys.stdin:
                for word in os.read(sys.stdin.fileno(), 64).decode().split():
                    whole = word == "go"
                continue
            try:
                data = end.recv(4096)
            except ConnectionRefusedError:  # UDP: the daemon does not listen yet
                continue
            if not data and end.type == socket.SOCK_STREAM:
                return
            if whole:
                ways[end](data)


if __name__ == "__main__":
    main()
