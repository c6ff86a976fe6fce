#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What `backwashctl serve` answers to requests that no browser would send, and to many of them.

requests.py URL PID alone                       no daemon answers
requests.py URL PID flight BACKWASHCTL DOMAIN   a vehicle is in the air
"""
import json
import math
import pathlib
import random
import subprocess
import sys
import time

from door import NOBODY, OTHER, PAGE, Page, ask, command, connect, host, port, raw, token
from floods import check_floods

pid = int(sys.argv[2])


def check_gate() -> None:
    status, headers, body = ask("GET", "/")
    assert status == 200 and "<title>backwash</title>" in body and token not in body
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "unsafe" not in policy and "frame-ancestors 'none'" in policy, policy
    assert headers["Referrer-Policy"] == "no-referrer" and headers["X-Content-Type-Options"] == "nosniff"
    assert not any(name.startswith("Access-Control") for name in headers), headers
    for path in ("/page.css", "/page.js", "/panels.js", "/picture.js", "/icon.svg"):
        assert ask("GET", path)[0] == 200, path
    for path in ("/command", "/nothing", "/../etc/passwd", "/page.js/..", "/%2e%2e/%2e%2e/etc/passwd"):
        assert ask("GET", path)[0] == 404, path
    # Names that another site may have; ours.
    for name in ("evil.example", f"evil.example:{port}", "127.0.0.1", "127.0.0.1:1", f"127.0.0.1.evil.example:{port}", f"localhost.:{port}"):
        assert ask("GET", "/", Host=name)[0] == 403, name
    assert ask("GET", "/", Host="")[0] == 403
    assert ask("GET", "/", Host=f"localhost:{port}")[0] == 200
    assert raw(f"GET / HTTP/1.1\r\nHost: {host}\r\nHost: evil.example\r\n\r\n".encode()).startswith(b"HTTP/1.1 403")
    for origin in ("null", "http://evil.example", f"https://{host}", f"http://localhost:{port}", f"http://127.0.0.1:{port + 1}"):
        assert ask("GET", "/", Origin=origin)[0] == 403, origin
        assert command("stop", Origin=origin) == 403, origin
    for site in ("cross-site", "same-site"):
        assert ask("GET", "/events?page=" + PAGE, Sec_Fetch_Site=site)[0] == 403, site
    # Each part is an answer of its own: 2600 in one request took 40 MB.
    assert ask("GET", "/page.js", Range="bytes=" + ",".join(["0-"] * 2600))[0] == 400
    for method in ("PUT", "DELETE", "OPTIONS", "PATCH", "HEAD", "TRACE"):
        assert raw(f"{method} /command HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()).split()[1] == b"405", method
    for wrong in ("", "0" * 32, token[:-1], token + "0", token.upper() + " x"):
        assert command("stop", X_Token=wrong) == 401, wrong
    assert ask("POST", "/preview", {"page": PAGE, "goal": [1, 2, 3]}, X_Token="")[0] == 401
    assert ask("POST", "/enter", {"page": PAGE}, X_Token="")[0] == 401
    for body in ("", "7", '{"page": 7}', '{"page": "x"}'):
        assert ask("POST", "/enter", body)[0] == 400, body
    assert command("stop", Content_Type="text/plain") == 415 and command("stop", Content_Encoding="gzip") == 415
    for body in ("", "{", "[]", "7", '{"verb": 8}', '{"verb": "enable"}', '{"verb": "goto"}', '{"verb": "goto", "goal": [1, 2]}', '{"verb": "goto", "goal": [1, 2, "3"]}',
                 '{"verb": "goto", "goal": [1, 2, 1e999]}', "[" * 4000, '{"verb": "st\u0000op"}'):
        assert ask("POST", "/command", body)[0] == 400, body[:60]
    assert ask("POST", "/command", {"page": NOBODY, "verb": "land"})[0] == 409
    assert ask("POST", "/command", "x" * 5000)[0] == 413
    for z in ("", "nan", "1e999", "1x", "%00"):
        assert ask("GET", "/slice?z=" + z)[0] in (400, 404), z
    for name in ("", "x", "A" * 32, "a" * 33, "../" * 10):
        assert ask("GET", "/events?page=" + name)[0] == 400, name


def check_garbage() -> None:
    random.seed(1)
    for n in range(300):
        data = random.randbytes(random.randrange(1, 400))
        if n % 2:
            good = bytearray(f"POST /command HTTP/1.1\r\nHost: {host}\r\nX-Token: {token}\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n{{\"a\": 12}}".encode())
            for _ in range(random.randrange(1, 9)):
                good[random.randrange(len(good))] = random.randrange(256)
            data = bytes(good)
        with connect() as s:
            s.sendall(data)
    # A head without an end, lines without an end, a chunked body without an end: each ends with its budget.
    for endless in (b"a: b\r\n" * 200_000, b"a" * 2_000_000):
        begun = time.monotonic()
        raw(f"GET / HTTP/1.1\r\nHost: {host}\r\n".encode() + endless)
        assert time.monotonic() - begun < 5
    head = f"POST /command HTTP/1.1\r\nHost: {host}\r\nX-Token: {token}\r\nContent-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
    assert b" 202 " not in raw(head.encode() + b"800\r\n" + b" " * 2048 + b"\r\n" + b"800\r\n" + (b" " * 2048 + b"\r\n800\r\n") * 100)


def memory() -> int:
    return int(next(line for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines() if line.startswith("VmRSS")).split()[1])


def check_slow(page: Page) -> None:
    """Who sends a byte now and then is closed after 3 s; of 600 idle connections 512 are kept, the newest."""
    slow = connect(10)
    slow.sendall(b"GET / HTTP/1.1\r\n")
    begun = time.monotonic()
    try:
        while time.monotonic() - begun < 10:
            slow.sendall(b"x")
            slow.settimeout(0.2)
            try:
                if not slow.recv(100):
                    break
            except TimeoutError:
                pass
    except (ConnectionResetError, BrokenPipeError):
        pass
    assert 2 < time.monotonic() - begun < 6, time.monotonic() - begun
    idle = [connect() for _ in range(600)]
    time.sleep(0.5)
    page.event()  # who has the token goes on
    closed = 0
    for s in idle:
        s.setblocking(False)
        try:
            closed += s.recv(100) != b"never"
        except BlockingIOError:
            pass
        except ConnectionResetError:
            closed += 1
    assert 600 - closed <= 512, closed
    assert command("stop") == 202  # they still hold what they have
    for s in idle:
        s.close()


def check_streams() -> None:
    pages = [Page(f"{n:032x}", False) for n in range(16)]
    time.sleep(0.5)
    assert ask("GET", "/events?page=" + "d" * 32)[0] == 409  # pages without the token are 16,
    holder = Page("e" * 32)  # which keeps none with it away
    assert holder.event() and command("hold", "e" * 32) == 202
    assert ask("GET", "/events?page=" + "e" * 32)[0] == 409  # it is open
    more = [Page(f"{n:032x}") for n in range(32, 32 + 14)]
    assert ask("POST", "/enter", {"page": NOBODY})[0] == 409  # of those there are 16 as well
    # Who reads nothing is dropped, and its place is free again.
    time.sleep(0.2)
    for page in [*pages, *more, holder]:
        page.close()
    time.sleep(2.5)


def check_flight(ctl: str, domain: str) -> None:
    def backwashctl(*line: str) -> subprocess.CompletedProcess:
        return subprocess.run([ctl, "--domain", domain, *line], capture_output=True, text=True)

    def status() -> dict:
        return json.loads(backwashctl("status", "--json").stdout)

    page, other = Page(PAGE), Page(OTHER)
    assert page.event()["session"]["holder"] == ""
    stops = page.event()["session"]["stops"]

    def go(stops: object) -> int:
        return ask("POST", "/command", {"page": PAGE, "verb": "goto", "goal": [2, 0, 1.2], "stops": stops})[0]

    # A way is shown before it is flown: from where the vehicle is to the goal, inside its tube; none into a wall.
    assert ask("POST", "/preview", {"page": PAGE, "goal": [2, 0, 1.2]})[0] == 202
    way = page.until("a way is planned", lambda e: e.get("preview") and e["preview"]["state"] == "ok", 30)["preview"]
    assert way["path"][-1] == [2000, 0, 1200] and math.dist(way["path"][0], [1e3 * v for v in status()["setpoint"]]) < 2, way["path"]
    for p in way["path"]:
        assert any(all(abs(p[d] - row[d]) <= row[3 + d] + 100 for d in range(3)) for row in way["tube"]), p
    assert ask("POST", "/preview", {"page": PAGE, "goal": [0, 2.1, 1.2]})[0] == 202
    assert "goal" in page.until("a wall is refused", lambda e: e.get("preview") and e["preview"]["state"] == "refused", 30)["preview"]["message"]
    field = json.loads(ask("GET", "/slice?z=1.2")[2])["field"]
    assert field["most"] >= max(field["values"]) / 100 - 0.01 > 0 and min(field["values"]) >= 0, field["most"]
    assert ask("POST", "/command", {"page": PAGE, "verb": "goto", "goal": [2, 0, 1.2]})[0] == 409  # of no number of STOPs
    assert [go(wrong) for wrong in (stops + 1, None, str(stops), -1)] == [409] * 4
    assert go(stops) == 202
    page.until("goto is accepted", lambda e: e["command"]["state"] == "accepted" and e["session"]["mine"])
    other.until("the other page is told", lambda e: "another page" in e["session"]["holder"])
    for verb in ("hold", "land", "release"):
        assert command(verb, OTHER) == 409, verb
    # Another station is told who has the session.
    told = backwashctl("--station", "rival", "hold")
    assert told.returncode == 69 and "session held by page@here" in told.stderr, told
    page.until("it moves", lambda e: e["status"]["moving"])
    # The battery that the bench's controller says once a second: four cells of 3.5 to 4.15 V by their share.
    power = page.until("the battery is told", lambda e: e["battery"])["battery"]
    assert 0.3 < power["share"] <= 1 and abs(power["voltage_v"] - 4 * (3.5 + 0.65 * power["share"])) < 0.02, power
    ages = [page.event()["battery"]["age_s"] for _ in range(10)]
    assert max(ages) < 2.5 and min(ages) >= 0, ages
    over = page.until("it is judged", lambda e: e["over_bound"])["over_bound"]
    assert max(map(abs, over)) < 1.5, over
    # STOP is anybody's, and takes no session: the holder's stays.
    assert command("stop", OTHER) == 202
    other.until("stop is accepted", lambda e: e["command"]["verb"] == "stop" and e["command"]["state"] == "accepted")
    # What was asked for before it, and comes late, is not flown.
    assert go(stops) == 409 and page.until("the STOP is counted", lambda e: e["session"]["stops"] == stops + 1)
    begun = time.monotonic()
    while (now := status())["moving"] or now["state"] != "hold":
        assert time.monotonic() - begun < 10, now
    assert page.event()["session"]["mine"]
    number, _, sliced = ask("GET", "/slice?z=1.2")
    sliced = json.loads(sliced)
    assert number == 200 and sum(sliced["runs"][1::2]) == sliced["size"][0] * sliced["size"][1] and abs(sliced["z"] - 1.2) < 0.11
    # A page that has gone holds nothing, here and at the daemon.
    page.close()
    other.until("the session is free", lambda e: e["session"]["holder"] == "", 4)
    time.sleep(1)
    assert backwashctl("--station", "rival", "land").returncode == 0, backwashctl("--station", "rival", "land").stderr
    print(f"error over bound {[round(r, 2) for r in over]}, stopped at {now['setpoint'][0]:.2f} m")


def main() -> None:
    if sys.argv[3] == "flight":
        return check_flight(sys.argv[4], sys.argv[5])
    check_gate()
    check_garbage()
    page = Page(PAGE)
    event = page.event()
    assert event["status"] is None and event["battery"] is None and event["age_s"] is None and event["command"] is None
    before = memory()
    check_streams()
    check_garbage()
    check_slow(page)
    check_floods(page)
    assert memory() - before < 8192, (before, memory())
    # Nobody answers: a STOP goes on being sent, a HOLD waits its turn.
    event = page.until("STOP is told of", lambda e: e["command"] and e["command"]["verb"] == "stop")
    assert event["command"]["state"] == "sent", event["command"]
    print(f"memory {before} -> {memory()} kB")


main()
