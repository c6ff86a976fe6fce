#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stands in the line between an autopilot and the daemon; what passes while it is cut is lost, as on a serial line.

relay.py tcp AUTOPILOT LISTEN   the autopilot listens on the port AUTOPILOT of 127.0.0.1, the daemon connects to LISTEN
relay.py udp HEARD TOLD         the autopilot sends to the port HEARD, the daemon listens on TOLD

Lines of standard input: cut, go.
"""
import os
import select
import socket
import sys

HERE = "127.0.0.1"


def tcp(autopilot_port, listen_port):
    waiting = socket.create_server((HERE, listen_port))
    daemon, _ = waiting.accept()
    autopilot = socket.create_connection((HERE, autopilot_port))
    for end in (daemon, autopilot):
        end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return {autopilot: daemon.sendall, daemon: autopilot.sendall}


def udp(heard_port, told_port):
    autopilot = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    autopilot.bind((HERE, heard_port))
    _, sender = autopilot.recvfrom(4096)
    daemon = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    return {autopilot: lambda data: daemon.sendto(data, (HERE, told_port)), daemon: lambda data: autopilot.sendto(data, sender)}


def main():
    ways = {"tcp": tcp, "udp": udp}[sys.argv[1]](int(sys.argv[2]), int(sys.argv[3]))
    whole = True
    while True:
        for end in select.select([sys.stdin, *ways], [], [])[0]:
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
