#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the raw logs of flights with a real autopilot say of the line and of the tick, all logs together, while set-points were sent.

link_figures.py [--messages] RAW_LOG …

Prints the bytes per second each way and their share of a line of 57,600 baud (8N1: 5,760 bytes/s); times in ms from a command to its
acknowledgement, and of TIMESYNC there and back; in µs from a tick's due time to its end, and from odometry to the wire. A frame's time in
the log is that of the control thread's poll (2 ms apart). --messages: also the bytes per second of each message.
"""
import argparse
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "system"))
import raw_log  # noqa: E402

LINE = 57600 / 10  # bytes/s
COMMAND_INT, COMMAND_ACK, TIMESYNC = 75, 77, 111


def payload(frame):
    """Zero bytes at the end of a payload are not sent."""
    return frame[10:10 + frame[1]] + bytes(64)


class Figures:
    def __init__(self):
        self.seconds = 0.0
        self.bytes = {raw_log.FRAME_IN: {}, raw_log.FRAME_OUT: {}}
        self.commands, self.timesync, self.ticks, self.odometry = [], [], [], []

    def add(self, path):
        """Of the log only from its first set-point to its last."""
        flown = raw_log.times(path, raw_log.FRAME_OUT, raw_log.SETPOINT)
        if not flown:
            sys.exit(f"{path}: no set-point")
        self.seconds += flown[-1] - flown[0]
        asked, due = {}, None
        for t, kind, body in raw_log.records(path):
            if not flown[0] <= t <= flown[-1]:
                continue
            if kind in self.bytes:
                message = raw_log.message_id(body)
                self.bytes[kind][message] = self.bytes[kind].get(message, 0) + len(body)
                self.follow(t, kind, message, body, asked)
            elif kind == raw_log.TICK:
                due = self.tick(body, due)

    def follow(self, t, kind, message, frame, asked):
        data = payload(frame)
        if kind == raw_log.FRAME_OUT and message in (raw_log.COMMAND, COMMAND_INT):
            asked.setdefault(struct.unpack_from("<H", data, 28)[0], t)
        elif kind == raw_log.FRAME_IN and message == COMMAND_ACK:
            begun = asked.pop(struct.unpack_from("<H", data)[0], None)
            if begun is not None:
                self.commands.append((t - begun) * 1e3)
        elif kind == raw_log.FRAME_IN and message == TIMESYNC:
            answered, ours = struct.unpack_from("<qq", data)
            if answered and 0 <= t - ours * 1e-9 < 1:  # ours: CLOCK_MONOTONIC, as the log
                self.timesync.append((t - ours * 1e-9) * 1e3)

    def tick(self, body, lateness_before):
        """The compute time in a record is that of the tick before it, whose lateness is in the record before."""
        compute, lateness, to_wire = struct.unpack_from("<3f", body, 48)
        if lateness_before is not None:
            self.ticks.append(lateness_before + compute)
        if to_wire >= 0:
            self.odometry.append(to_wire)
        return lateness


def spread(name, unit, values):
    values = sorted(values)
    if not values:
        return f"{name}: none"
    at = lambda q: values[min(len(values) - 1, int(q * len(values)))]
    return f"{name}: median {at(0.5):.1f} {unit}, p99 {at(0.99):.1f}, largest {values[-1]:.1f}, of {len(values)}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--messages", action="store_true")
    parser.add_argument("logs", nargs="+")
    options = parser.parse_args()
    figures = Figures()
    for path in options.logs:
        figures.add(path)
    for kind, name in ((raw_log.FRAME_OUT, "to the autopilot"), (raw_log.FRAME_IN, "from the autopilot")):
        rates = {message: size / figures.seconds for message, size in figures.bytes[kind].items()}
        total = sum(rates.values())
        print(f"{name}: {total:.0f} bytes/s, {100 * total / LINE:.0f} % of 57,600 baud")
        if options.messages:
            for message, rate in sorted(rates.items(), key=lambda item: -item[1]):
                print(f"  {message:5} {rate:8.1f} bytes/s")
    print(spread("command to acknowledgement", "ms", figures.commands))
    print(spread("TIMESYNC there and back", "ms", figures.timesync))
    print(spread("tick, due time to end", "us", figures.ticks))
    print(spread("odometry to wire", "us", figures.odometry))


if __name__ == "__main__":
    main()
