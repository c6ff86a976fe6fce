#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Well-formed discovery of participants that do not exist (docs/faults.md row 26): the vehicle's own announcement, heard on
the loopback interface, said again under drawn GUIDs and for ever.

strangers.py DOMAIN COUNT RATE SOCKETS [again|dependent|endpoints|forwarded|dispose PARTICIPANT]
  COUNT announcements, RATE a second (0: as fast as they go), from SOCKETS ports in turn, each of a new GUID; or
  again        each of them ten times
  dependent    all as of one service of OpenSplice's, whose lease is theirs
  endpoints    of one participant, and then COUNT writers of it, of parts of maps
  forwarded    COUNT announcements by one participant of others
  dispose      that PARTICIPANT is gone, as the liveliness topic of another says it
Prints a line when it begins, and the seconds that it took. It keeps its ports until it is killed: whoever got one of them would be
taken for it.
"""
import os
import random
import signal
import socket
import struct
import sys
import time

LEASE = struct.pack("<HH", 2, 8)
GROUP, LOOPBACK = "239.255.0.1", "127.0.0.1"
SEDP, MESSAGE = bytes.fromhex("000003c2"), bytes.fromhex("000200c2")
random.seed(48)


def heard(port: int) -> bytes:
    """The first announcement, and not of an end."""
    ear = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    ear.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    ear.bind(("", port))
    ear.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, socket.inet_aton(GROUP) + socket.inet_aton(LOOPBACK))
    ear.settimeout(60)
    while True:
        packet = ear.recv(65536)
        if packet[:4] == b"RTPS" and bytes.fromhex("000100c2") in packet and LEASE in packet and packet.count(packet[8:20]) > 1:
            return packet


def endless(packet: bytes) -> bytes:
    """With the longest lease, and no multicast group: answers go to its own address, and are kept."""
    lease = packet.index(LEASE)
    packet = packet[: lease + 4] + struct.pack("<II", 0x7FFFFFFF, 0xFFFFFFFF) + packet[lease + 12 :]
    return packet.replace(struct.pack("<HH", 0x33, 24), struct.pack("<HH", 0, 24))


def submessage(kind: int, flags: int, body: bytes) -> bytes:
    return struct.pack("<BBH", kind, flags, len(body)) + body


def data(writer: bytes, number: int, payload: bytes, flags: int = 5, before: bytes = b"") -> bytes:
    return submessage(0x15, flags, struct.pack("<HHI", 0, 16, 0) + writer + struct.pack("<iI", 0, number) + before + payload)


def heartbeat(writer: bytes, last: int, count: int) -> bytes:
    return submessage(7, 1, bytes(4) + writer + struct.pack("<iIiII", 0, 1, 0, last, count))


def listed(*parameters: tuple[int, bytes]) -> bytes:
    return b"\0\3\0\0" + b"".join(struct.pack("<HH", i, len(v)) + v for i, v in (*parameters, (1, b"")))


def text(value: bytes) -> bytes:
    return struct.pack("<I", len(value) + 1) + value + b"\0" * (4 - len(value) % 4)


def endpoint(prefix: bytes, number: int) -> bytes:
    guid = prefix + struct.pack(">I", number << 8 | 3)
    said = listed((0x5A, guid), (0x05, text(b"rt/backwash/map_part")), (0x07, text(b"backwash_msgs::msg::dds_::MapPart_")))
    return data(SEDP, number, said) + heartbeat(SEDP, number, number)


def main() -> int:
    domain, count, rate, sockets = (int(a) for a in sys.argv[1:5])
    how = sys.argv[5] if len(sys.argv) > 5 else "new"
    port = 7400 + 250 * domain
    known = heard(port)
    own, template = known[8:20], endless(known)
    outs = []
    for _ in range(sockets):
        outs.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        outs[-1].setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
    if how == "dependent":
        version = template.index(struct.pack("<H", 0x8007)) + 8
        template = template[:version] + bytes([template[version] | 0x18]) + template[version + 1 :]
    one = os.urandom(12)
    print("begun", flush=True)
    begun = time.monotonic()
    for number in range(count):
        prefix = one if how in ("endpoints", "dispose") else random.randbytes(12)
        if how == "dependent":
            prefix = one[:4] + prefix[4:]
        packet = template.replace(own, prefix)
        if how == "forwarded":
            packet = packet[:8] + one + packet[20:]
        elif how == "endpoints" and number:
            packet = packet[:20].replace(own, prefix) + endpoint(prefix, number)
        elif how == "dispose" and number:
            status = struct.pack("<HH", 0x71, 4) + b"\0\0\0\3" + struct.pack("<HH", 1, 0)
            gone = b"\0\1\0\0" + bytes.fromhex(sys.argv[6].replace(":", ""))[:12] + struct.pack("<II", 0x01000000, 0)
            said = data(MESSAGE, number, gone, 0x07, status) + heartbeat(MESSAGE, number, number)
            packet = packet[:20] + said
        elif how == "dependent" and number:  # the first is the service
            packet = packet[:version] + bytes([packet[version] & ~0x10]) + packet[version + 1 :]
        for _ in range(10 if how == "again" else 1):
            outs[number % sockets].sendto(packet, (GROUP, port))
        if how in ("endpoints", "dispose") and number == 0:
            time.sleep(0.5)
        if rate and (ahead := begun + number / rate - time.monotonic()) > 0.001:
            time.sleep(ahead)
    print(f"{time.monotonic() - begun:.1f}", flush=True)
    signal.pause()
    return 0


if __name__ == "__main__":
    sys.exit(main())
