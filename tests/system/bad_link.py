# SPDX-License-Identifier: BSD-3-Clause
"""A bad line between two network namespaces, in user space: the kernel's netem is not everywhere.

    bad_link.py OTHER_PID [--loss 0.3] [--delay 0.05 0.1] [--rate 1e6] [--queue 0.5] [--seed 1] [--csv FILE]

Makes tun0 here (10.9.0.1) and tun0 in the network namespace of process OTHER_PID (10.9.0.2), says "ready", and carries
packets between them until SIGTERM. Each way has a queue that `rate` (bit/s) empties and that holds `queue` seconds of it:
a packet that finds it full is lost, as in a radio's modem. Then a packet is lost with the probability `loss`, or comes after a
delay (s) drawn between the two given: later ones may overtake. At the end it prints what each way carried.
SIGUSR1: the interface of the other namespace vanishes, and the line with it.
"""
import argparse
import ctypes
import fcntl
import heapq
import os
import random
import select
import signal
import struct
import subprocess
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI, CLONE_NEWNET = 0x400454CA, 0x0001, 0x1000, 0x40000000


def tun(address, peer):
    """A tun0 in the present namespace; lives as long as its descriptor."""
    fd = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(fd, TUNSETIFF, struct.pack("16sH22x", b"tun0", IFF_TUN | IFF_NO_PI))
    for line in (f"address add {address} peer {peer} dev tun0", "link set tun0 up multicast on txqueuelen 20000"):
        subprocess.run(["ip", *line.split()], check=True)
    return fd


class Way:
    def __init__(self, given, out, seed):
        self.given, self.out, self.random = given, out, random.Random(seed)
        self.free = 0.0  # when the last packet of the queue will be sent
        self.air = []  # (when it arrives, number, packet)
        self.counts = {"offered": 0, "bytes": 0, "overflow": 0, "lost": 0, "carried": 0, "carried_bytes": 0}

    def offer(self, packet, now):
        c = self.counts
        c["offered"] += 1
        c["bytes"] += len(packet)
        start = max(self.free, now)
        if start - now > self.given.queue:
            c["overflow"] += 1
            return
        self.free = start + 8 * len(packet) / self.given.rate
        if self.random.random() < self.given.loss:
            c["lost"] += 1
            return
        heapq.heappush(self.air, (self.free + self.random.uniform(*self.given.delay), c["offered"], packet))

    def deliver(self, now):
        while self.air and self.air[0][0] <= now:
            packet = heapq.heappop(self.air)[2]
            try:
                os.write(self.out, packet)
            except OSError:
                continue
            self.counts["carried"] += 1
            self.counts["carried_bytes"] += len(packet)


def carry(a, b, given):
    ways = {a: Way(given, b, given.seed), b: Way(given, a, given.seed + 1)}
    stop, vanish = [], []
    signal.signal(signal.SIGTERM, lambda *_: stop.append(1))
    signal.signal(signal.SIGUSR1, lambda *_: vanish.append(1))
    print("ready", flush=True)
    while not stop:
        if vanish and b in ways:
            os.close(b)
            ways = {}
            print("the other end is gone", flush=True)
        due = min((w.air[0][0] for w in ways.values() if w.air), default=time.monotonic() + 0.1)
        wait = min(max(due - time.monotonic(), 0), 0.1)
        try:
            ready = select.select(list(ways), [], [], wait)[0]
        except InterruptedError:
            continue
        now = time.monotonic()
        for fd in ready:
            for _ in range(64):
                try:
                    ways[fd].offer(os.read(fd, 65536), now)
                except OSError:
                    break
        for way in ways.values():
            way.deliver(now)
    for name, way in zip(("here to other", "other to here"), ways.values()):
        print(name, way.counts, flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("other", type=int)
    parser.add_argument("--loss", type=float, default=0.3)
    parser.add_argument("--delay", type=float, nargs=2, default=(0.05, 0.1))
    parser.add_argument("--rate", type=float, default=1e6)
    parser.add_argument("--queue", type=float, default=0.5)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    here = tun("10.9.0.1", "10.9.0.2")
    there = os.open(f"/proc/{given.other}/ns/net", os.O_RDONLY)
    if ctypes.CDLL(None, use_errno=True).setns(there, CLONE_NEWNET) != 0:
        raise OSError(ctypes.get_errno(), "setns")
    carry(here, tun("10.9.0.2", "10.9.0.1"), given)


if __name__ == "__main__":
    main()
