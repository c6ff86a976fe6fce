# SPDX-License-Identifier: BSD-3-Clause
"""Requests to `backwashctl serve`, byte by byte; the address with its token is the first argument of the program."""
import json
import socket
import sys
import time
import urllib.parse

url = urllib.parse.urlsplit(sys.argv[1])
token, port = url.fragment, url.port
host = f"127.0.0.1:{port}"
PAGE, OTHER, NOBODY = "a" * 32, "b" * 32, "c" * 32


def connect(timeout: float = 5) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout)


def raw(data: bytes, timeout: float = 5) -> bytes:
    """All that comes back until the other side closes."""
    with connect(timeout) as s:
        got = b""
        try:
            s.sendall(data)
            while part := s.recv(65536):
                got += part
        except (ConnectionResetError, BrokenPipeError):
            pass
        return got


def ask(method: str, path: str, body: object = None, **headers: str) -> tuple[int, dict, str]:
    """Status, headers, body. Of a POST everything is right but what `headers` says otherwise ("": left out)."""
    text = body if isinstance(body, str) else "" if body is None else json.dumps(body)
    all_ = {"Host": host}
    if method == "POST":
        all_ |= {"X-Token": token, "Content-Type": "application/json", "Origin": f"http://{host}", "Content-Length": str(len(text.encode()))}
    all_ |= {name.replace("_", "-"): value for name, value in headers.items()}
    head = f"{method} {path} HTTP/1.1\r\n" + "".join(f"{name}: {value}\r\n" for name, value in all_.items() if value) + "\r\n"
    answer = raw((head + text).encode())
    top, _, rest = answer.partition(b"\r\n\r\n")
    lines = top.decode(errors="replace").split("\r\n")
    assert lines[0].startswith("HTTP/1.1 "), (method, path, headers, answer[:200])
    return int(lines[0].split()[1]), dict(line.split(": ", 1) for line in lines[1:]), rest.decode()


class Page:
    """A stream of events, as a page holds it."""

    def __init__(self, name: str, has_token: bool = True):
        if has_token:
            assert ask("POST", "/enter", {"page": name})[0] == 202, name
        self.socket = connect()
        self.socket.sendall(f"GET /events?page={name} HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        self.text, self.last = b"", {}

    def event(self) -> dict:
        """The newest, with what earlier ones said last of what comes only when it changes. Two are waited for."""
        fresh = 0
        while fresh < 2:
            part = self.socket.recv(1 << 20)
            assert part, "the stream ended"
            *whole, self.text = (self.text + part).split(b"\n\n")
            for one in whole:
                self.last |= json.loads(one.partition(b"data: ")[2])
            fresh += len(whole)
        return self.last

    def until(self, what: str, holds, seconds: float = 5) -> dict:
        begun = time.monotonic()
        while not holds(event := self.event()):
            assert time.monotonic() - begun < seconds, (what, event["command"], event["session"])
        return event

    def close(self) -> None:
        self.socket.close()


def command(verb: str, page: str = PAGE, **headers: str) -> int:
    return ask("POST", "/command", {"page": page, "verb": verb}, **headers)[0]
