#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Stands between the flight controller's serial port and the daemon's, and changes what the controller says.

line_filter.py CONTROLLER LINK armed FILE   from when FILE exists: its heartbeats say that it is armed
line_filter.py CONTROLLER LINK silent FILE  from when FILE exists: neither LOCAL_POSITION_NED nor attitude
"""
import os
import select
import sys
import tty

from mavlink_crc import crc

HEARTBEAT, ATTITUDE, ATTITUDE_QUATERNION, LOCAL_POSITION_NED = 0, 30, 31, 32
HEARTBEAT_EXTRA = 50


def frames(buffer):
    """Takes whole MAVLink 2 frames off the buffer; the bench sends nothing else."""
    while len(buffer) >= 12:
        size = 12 + buffer[1]
        if len(buffer) < size:
            return
        yield bytearray(buffer[:size])
        del buffer[:size]


def changed(frame, what, trigger):
    message = frame[7] | frame[8] << 8 | frame[9] << 16
    if not os.path.exists(trigger):
        return frame
    if what == "armed" and message == HEARTBEAT and frame[1] >= 7:
        frame[10 + 6] |= 0x80
        value = crc(frame[1:-2] + bytes([HEARTBEAT_EXTRA]))
        frame[-2:] = bytes([value & 0xFF, value >> 8])
    if what == "silent" and message in (ATTITUDE, ATTITUDE_QUATERNION, LOCAL_POSITION_NED):
        return b""
    return frame


def main():
    controller_path, link, what, trigger = sys.argv[1:]
    controller = os.open(controller_path, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(controller)
    ours, daemons = os.openpty()
    tty.setraw(daemons)  # kept open: a daemon that closes its end is no hang-up
    os.symlink(os.ttyname(daemons), link)
    buffer = bytearray()
    while True:
        ready, _, _ = select.select([controller, ours], [], [])
        if ours in ready:
            os.write(controller, os.read(ours, 4096))
        if controller in ready:
            buffer += os.read(controller, 4096)
            out = b"".join(bytes(changed(f, what, trigger)) for f in frames(buffer))
            if out:
                os.write(ours, out)


if __name__ == "__main__":
    main()
