#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whoever does not show the token keeps no STOP of an open page away from `backwashctl serve`, whatever it sends.

floods.py URL FLOOD     sends one of FLOODS until it is ended
"""
import random
import socket
import subprocess
import sys
import threading
import time

from door import PAGE, Page, command, connect, host

LIMIT_S, STOPS, HELD = 0.5, 40, 100  # connections that each of a flood's threads holds
POST = f"POST /command HTTP/1.1\r\nHost: {host}\r\nContent-Type: application/json\r\n"


def draw() -> str:
    return f"{random.getrandbits(128):032x}"


FLOODS = {
    "streams": lambda: f"GET /events?page={draw()} HTTP/1.1\r\nHost: {host}\r\n\r\n",
    "idle connections": lambda: "",
    "heads without an end": lambda: f"GET / HTTP/1.1\r\nHost: {host}\r\nA: {'a' * random.randrange(9000)}",
    "bodies without an end": lambda: POST + "Content-Length: 4096\r\n\r\n" + "{" * 2000,
    "guessed tokens": lambda: POST + f"X-Token: {draw()}\r\nContent-Length: 2\r\n\r\n{{}}",
    "answers not taken": lambda: f"GET /page.js HTTP/1.1\r\nHost: {host}\r\n\r\n",
    "garbage": lambda: "\r\n\r\n" + random.randbytes(3000).hex(),
}


def flood(data) -> None:
    """As fast as connections are taken; each goes on byte by byte until newer ones take its place."""
    held: list[socket.socket] = []
    while True:
        try:
            held.append(connect(1))
            held[-1].sendall(data().encode())
            random.choice(held).sendall(b"a")
        except OSError:
            pass
        if len(held) > HELD:
            held.pop(random.randrange(2)).close()
        time.sleep(0.001)


class Meter(threading.Thread):
    """How long this machine let us wait for a processor."""

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.stood_s = 0.0
        self.start()

    def run(self) -> None:
        while True:
            due = time.monotonic() + 0.005
            time.sleep(0.005)
            self.stood_s += max(0.0, time.monotonic() - due - 0.001)


def stops(page: Page, meter: Meter, what: str) -> None:
    took, stood, taken = [], [], 0
    counted = page.event()["session"]["stops"]
    for _ in range(STOPS):
        begun, before = time.monotonic(), meter.stood_s
        try:
            taken += command("stop") == 202
        except (AssertionError, OSError):
            pass
        took.append(time.monotonic() - begun)
        stood.append(meter.stood_s - before)
        time.sleep(0.01)
    print(f"{what}: {taken} of {STOPS} STOPs taken, median {1e3 * sorted(took)[STOPS // 2]:.0f} ms, slowest {1e3 * max(took):.0f} ms", flush=True)
    assert taken == STOPS, what
    for t, s in zip(took, stood):
        if t > LIMIT_S:
            print(f"one took {t:.2f} s, of which this machine stood still for {s:.2f} s")
        assert t - s <= LIMIT_S, what
    page.until("each is told of", lambda event: event["session"]["stops"] == counted + STOPS)


def check_floods(page: Page) -> None:
    """Beside each flood 40 of 40 STOPs are taken at the first attempt, and the open page hears of each."""
    meter = Meter()
    stops(page, meter, "no flood")
    for what in FLOODS:
        strangers = subprocess.Popen([sys.executable, __file__, sys.argv[1], what])
        try:
            time.sleep(1)
            stops(page, meter, what)
        finally:
            strangers.kill()
            strangers.wait()


if __name__ == "__main__":
    for _ in range(6):
        threading.Thread(target=flood, args=(FLOODS[sys.argv[2]],)).start()
