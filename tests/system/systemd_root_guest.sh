#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Run by systemd_root.sh inside its root, under the systemd there. Each "systemd: …" line is something that was seen.
set -euo pipefail
unit=backwashd.service
seen() { echo "systemd: $*"; }
die() {
  echo "FAILED: $*"
  systemctl status $unit --no-pager -l || true
  journalctl --no-pager -o short-precise -u $unit -u bench.service | tail -n 60
  exit 1
}
get() { systemctl show "$unit" --value -p "$1"; }
now_ms() { date +%s%3N; }
# journal_line TEXT [SINCE]: it is there, as one line since SINCE (a cursor of this script).
journal_line() { [[ $(journalctl -u $unit --since "@$since" -o cat --no-pager | grep -cF -- "$1") -eq 1 ]] ||
  die "the journal has not one line '$1': $(journalctl -u $unit --since "@$since" -o cat --no-pager | tail -n 20)"; }
mark() { sleep 1; since=$(date +%s); }
# until_true WHAT SECONDS COMMAND …
until_true() {
  local what=$1 tries=$(($2 * 10))
  shift 2
  for _ in $(seq $tries); do "$@" && return; sleep 0.1; done
  die "$what"
}
state() { backwashctl status --json 2>/dev/null | grep -o "\"$1\": *[^,}]*" | sed 's/.*: *//; s/"//g'; }
is_state() { [[ $(state state) == "$1" ]]; }
bench() { # MAP START
  printf 'MAP=%s\nSTART=%s\n' "$1" "$2" >/etc/bench
  systemctl restart bench.service
  until_true "the bench has no port" 10 test -e /run/bench/autopilot
}
# stopped_within_2s WHERE
stopped_within_2s() {
  local begun took
  begun=$(now_ms)
  systemctl stop $unit
  took=$(($(now_ms) - begun))
  [[ $(get Result) == success && $(get ExecMainStatus) == 0 ]] || die "$1: SIGTERM gave $(get Result), status $(get ExecMainStatus)"
  [[ $took -lt 2000 ]] || die "$1: SIGTERM took $took ms"
  seen "$1: SIGTERM, gone after $took ms"
}
enable() { # the controller may not be heard yet
  for _ in $(seq 40); do backwashctl enable --wait >/tmp/enable 2>&1 && return; sleep 0.25; done
  die "enabling: $(cat /tmp/enable)"
}
with_map() { until_true "no map" 120 sh -c "journalctl -u $unit --since @$since -o cat | grep -q 'map accepted'"; }

# Ready, with its rights and without others.
mark
bench builtin:parallel-walls-4m -2,0,1.2
begun=$(now_ms)
systemctl start $unit || die "it does not start"
seen "ready after $(($(now_ms) - begun)) ms"
[[ $(get SubState) == running && $(get NRestarts) == 0 ]] || die "not running: $(get SubState)"
pid=$(get MainPID)
[[ $(ps -o user= -p "$pid") == backwash ]] || die "runs as $(ps -o user= -p "$pid")"
grep -q '^CapEff:[[:space:]]*0000000000000000$' "/proc/$pid/status" || die "it has capabilities"
grep -q '^NoNewPrivs:[[:space:]]*1' "/proc/$pid/status" || die "it may gain privileges"
if awk '/^Max realtime priority/ { exit !($5 >= 95) }' /proc/1/limits; then # a container whose makers lack CAP_SYS_RESOURCE has none to give
  ps -L -o cls=,rtprio= -p "$pid" | grep -q 'FF *80' || die "no thread has SCHED_FIFO 80"
  [[ $(awk '/^VmLck/ { print $2 }' "/proc/$pid/status") -gt 10000 ]] || die "its memory is not locked"
  seen "SCHED_FIFO 80, memory locked"
else
  seen "NOT seen: SCHED_FIFO and locked memory, which this container may not give"
fi
seen "its own user, no capability"
until_true "no status line" 5 sh -c "systemctl show $unit --value -p StatusText | grep -q '^passive: '"
journalctl -u $unit --since "@$since" BACKWASH_MODE=passive -o json --no-pager | grep -q '"BACKWASH_REASON":"started"' ||
  die "the journal has no field BACKWASH_REASON"
seen "a transition has its fields in the journal"

# A control thread that hangs in flight: the watchdog, a restart, and passive until an operator enables.
with_map
enable
backwashctl takeoff --height 1.2 --wait >/dev/null || die "no take-off"
mark
stopped=$(now_ms)
kill -STOP "$pid"
until_true "the watchdog did not bite" 10 sh -c "p=\$(systemctl show $unit --value -p MainPID); [ \"\$p\" != 0 ] && [ \"\$p\" != $pid ]"
until_true "not ready again" 10 sh -c "[ \$(systemctl show $unit --value -p SubState) = running ]"
seen "SIGSTOP in flight: watchdog and restart in $(($(now_ms) - stopped)) ms"
[[ $(get NRestarts) == 1 ]] || die "$(get NRestarts) restarts"
journal_line 'Watchdog timeout'
for _ in $(seq 20); do
  [[ $(state state) == passive && $(state setpoints_sent) == 0 ]] || die "after the restart: $(state state), $(state setpoints_sent) set-points"
  sleep 0.1
done
seen "after the restart passive, not a set-point"
with_map
until_true "the vehicle does not land by itself" 60 sh -c "backwashctl status --json | grep -Eq '\"armed\": *false'"
enable
is_state tracking || is_state enabling || die "enabled, and is $(state state)"
seen "an operator enables it again"

# SIGTERM in every state; the rest of the states: daemon_stop.sh.
backwashctl takeoff --height 1.2 --wait >/dev/null || die "no take-off"
stopped_within_2s "in flight"
bench builtin:apartment 3.0,4.2,1.2
systemctl start $unit
sleep 0.3
stopped_within_2s "while a world is built"

# The device vanishes and returns: the same process, one line each.
mark
systemctl start $unit
until_true "the link is not there" 10 sh -c "[ -n \"\$(backwashctl status --json)\" ]"
pid=$(get MainPID)
sleep 2
systemctl stop bench.service
until_true "the loss is not told" 10 sh -c "journalctl -u $unit --since @$since -o cat | grep -q 'loss 1'"
bench builtin:parallel-walls-4m -2,0,1.2
until_true "the port is not opened again" 10 sh -c "journalctl -u $unit --since @$since -o cat | grep -q 'link good'"
[[ $(get MainPID) == "$pid" ]] || die "it was restarted"
journal_line 'loss 1'
journal_line 'link good'
seen "the device vanished and returned: the same process, one line each"
systemctl stop $unit

# A disk that is full costs the log and nothing else.
mount -t tmpfs -o size=64k,mode=750,uid="$(id -u backwash)",gid="$(id -g backwash)" disk /var/lib/backwash
mark
systemctl start $unit || die "a full disk keeps it from starting"
until_true "the full disk is not told" 20 sh -c "journalctl -u $unit --since @$since -o cat | grep -qi 'no space left'"
sleep 2
[[ $(get SubState) == running && $(get NRestarts) == 0 ]] || die "a full disk ended it"
[[ $(journalctl -u $unit --since "@$since" -o cat --no-pager | grep -ci 'no space left') -le 2 ]] || die "a full disk floods the journal"
stopped_within_2s "on a full disk"
umount /var/lib/backwash

# An invalid configuration: said in one line, exit code 78, no loop.
sed -i 's/^baud = .*/baud = 12/' /etc/backwash/backwashd.toml
mark
systemctl start $unit 2>/dev/null && die "it started with an invalid configuration" || true
sleep 3
[[ $(get ExecMainStatus) == 78 && $(get NRestarts) == 0 && $(get SubState) == failed ]] ||
  die "invalid configuration: status $(get ExecMainStatus), $(get NRestarts) restarts, $(get SubState)"
journal_line "key 'link.baud' = 12"
seen "invalid configuration: exit 78, no restart, one line"
seen "all seen"
