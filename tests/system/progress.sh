#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What long work shows, and what Ctrl-C leaves of it: a bar with rate and time left on a terminal, a line each 10 s otherwise,
# nothing with --quiet; scenes that compare has flown are judged and written.
#   progress.sh BACKWASH
source "$(dirname "${BASH_SOURCE[0]}")/verb.sh"
python3 - "$backwash" <<'PYTHON'
import csv, os, pty, re, select, signal, subprocess, sys, time

backwash = sys.argv[1]
TWO = ["compare", "--vehicle", "builtin:quad-5in", "--scenes", "builtin:narrow-gap", "builtin:corridors"]


def started(*arguments, terminal):
    ours, theirs = pty.openpty() if terminal else os.pipe()
    child = subprocess.Popen([backwash, *arguments], stdout=open("stdout", "w"), stderr=theirs)
    os.close(theirs)
    return child, ours


def read(fd, seconds, until=None):
    """What is said in so many seconds, or up to what ends it."""
    said, end = "", time.monotonic() + seconds
    while time.monotonic() < end and not (until and re.search(until, said)):
        if select.select([fd], [], [], 0.1)[0]:
            try:
                more = os.read(fd, 4096)
            except OSError:  # the terminal's other end is closed
                return said
            if not more:
                return said
            said += more.decode()
    return said


# A terminal: the bar, and the first of two scenes after Ctrl-C in the second.
child, fd = started(*TWO, "--flights", "150", "--out", "two.csv", terminal=True)
said = read(fd, 120, until=r"corridors, [^\r]*planning and flying")
child.send_signal(signal.SIGINT)
said += read(fd, 120, until=r"interrupted after[^\n]*\n")
assert child.wait(60) == 130, said
assert re.search(r"\r\x1b\[K[^\r]* \[#*\.*\] \d+ %, \d+ of \d+, [\d.]+/s, \d+ s left", said), said
assert said.count("\n") == 1 and "interrupted after 1 of 2 scenes and vehicles" in said.rsplit("\r\x1b[K", 1)[1], said
rows = list(csv.DictReader(open("two.csv")))
assert {r["scene"] for r in rows} == {"builtin:narrow-gap"} and len(rows) % 150 == 0 and rows, len(rows)
assert "pairs that all methods solve" in open("stdout").read()

# No terminal: a line after 10 s, none before. In the first scene nothing is finished yet.
child, fd = started(*TWO, "--flights", "1200", "--out", "none.csv", terminal=False)
begun = time.monotonic()
said = read(fd, 60, until=r"\n")
assert time.monotonic() - begun > 9.5, said
assert re.fullmatch(r"builtin:narrow-gap, [^\n]*\n", said) and "\r" not in said, said
child.send_signal(signal.SIGINT)
said = read(fd, 60)
assert child.wait(60) == 130 and "interrupted before the first scene" in said and not os.path.exists("none.csv"), said

# --quiet shows nothing, on a terminal neither.
child, fd = started(*TWO, "--flights", "1200", "--quiet", terminal=True)
assert read(fd, 5) == ""
child.kill()
child.wait()
PYTHON
