# SPDX-License-Identifier: BSD-3-Clause
"""Connections of others to `backwashctl serve`, for requests.py."""
import socket
import threading
import time


class Renewed:
    """So many connections that say nothing; each that is closed comes again, for ever."""

    def __init__(self, port: int, count: int):
        self.port = port
        self.over = threading.Event()
        self.threads = [threading.Thread(target=self.hold) for _ in range(count)]

    def hold(self) -> None:
        while not self.over.is_set():
            try:
                with socket.create_connection(("127.0.0.1", self.port), 0.3) as s:
                    while not self.over.is_set():
                        try:
                            if not s.recv(100):
                                break
                        except TimeoutError:
                            pass
            except OSError:
                pass

    def __enter__(self) -> None:
        for thread in self.threads:
            thread.start()
        time.sleep(0.5)

    def __exit__(self, *_: object) -> None:
        self.over.set()
        for thread in self.threads:
            thread.join()
