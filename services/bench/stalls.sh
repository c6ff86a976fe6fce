# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts that judge a flight of the real processes: whether a failed one says anything about the vehicle, or only
# that this machine stood still meanwhile.

# What the emulated vehicle bears is two control periods: it is a process like any other, and hardware does not wait for one.
readonly longest_stall_ms=40 says_nothing=75

# stalls FILE: writes how long this machine let an ordinary process wait at most so far, ms, for its turn and for what it wrote to a
# pseudo-terminal, until it is ended. The emulated link is one, and is carried by a worker of the kernel, which waits for its own turn.
stalls() {
  exec python3 - "$1" <<'PYTHON'
import os, sys, time, tty
link, end = os.openpty()
tty.setraw(end)
worst, due = 0.0, time.monotonic()
while True:
    due = time.monotonic() + 0.005
    time.sleep(0.005)
    os.write(link, b".")
    os.read(end, 1)
    late = (time.monotonic() - due) * 1e3
    if late > worst:
        worst = late
        with open(sys.argv[1], "w") as file:
            file.write(f"{worst:.0f}")
PYTHON
}

# told_nothing NAME, of NAME.log and NAME.stall: why a failed flight says nothing about the vehicle; fails if it does.
told_nothing() {
  local worst processors busy
  worst=$(cat "$1.stall" 2>/dev/null || echo 0) processors=$(nproc)
  busy=$(cut -d. -f1 /proc/loadavg)
  if grep -q 'the daemon accepted no map' "$1.log" && [[ $busy -gt $processors ]]; then
    echo "no world was built in 120 s: $busy processes wanted $processors processors"
  elif [[ $worst -ge $longest_stall_ms ]]; then
    echo "this machine stood still for $worst ms"
  else
    return 1
  fi
}

# tried NAME COMMAND …: the exit code of a flight that writes NAME.log; says_nothing for one that failed on a machine that
# stood still.
tried() {
  local name=$1 meter status=0 why
  shift
  rm -f "$name.stall"
  stalls "$name.stall" &
  meter=$!
  "$@" || status=$?
  kill "$meter" && { wait "$meter" || true; } 2>/dev/null
  [[ $status -ne 0 && $status -ne 64 ]] || return "$status"
  why=$(told_nothing "$name") || return "$status"
  echo "$(basename "$name"): $why: the flight says nothing" >&2
  return $says_nothing
}

# twice COMMAND …: once more if the first says nothing.
twice() {
  local status=0
  "$@" || status=$?
  [[ $status -eq $says_nothing ]] || return "$status"
  echo "once more" >&2
  "$@"
}
