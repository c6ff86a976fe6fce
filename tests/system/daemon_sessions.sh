#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Who may command, and whose odometry is flown (docs/faults.md rows 28 and 48), with real processes: a second station
# and a second writer under the holder's name are refused, replays too; a repeat is answered again and not done again; an
# old sequence number counts for nothing; an answer is its writer's; STOP is anybody's; a session ends with its process,
# however that ends; of two daemons in one name space none is enabled.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
enable=1 disable=2 takeoff=3 hold=5 release=7 stop_now=8 # verbs of idl/backwash_msgs.idl

# open NAME: a station's process, one writer; ask NAME COMMAND…: the answer to its command is in $answer.
open() {
  mkfifo "$work/$1.in" "$work/$1.out"
  "$build/tests/station_probe" "$domain" backwash script <"$work/$1.in" >"$work/$1.out" 2>>"$log" &
  declare -g "pid_$1=$!"
  more_pids+=($!)
  local fd
  exec {fd}>"$work/$1.in"
  declare -g "in_$1=$fd"
  exec {fd}<"$work/$1.out"
  declare -g "out_$1=$fd"
}
ask() {
  local in=in_$1 out=out_$1
  shift
  echo "$*" >&"${!in}"
  read -r -t 20 answer <&"${!out}" || die "no answer to $*"
  echo "$* -> $answer" | tee -a "$log"
}
expect() { # expect PATTERN NAME COMMAND…
  local pattern=$1
  shift
  ask "$@"
  [[ $answer == $pattern ]] || die "$* was answered '$answer', expected '$pattern'"
}
status() { "$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"; }
holds() {
  status
  python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); assert eval(sys.argv[2]), (sys.argv[2], s)' "$work/status.json" "$1"
}
tracks() { # the autopilot follows after a second of set-points and its next heartbeat
  for _ in $(seq 40); do status; grep -q '"state": *"tracking"' "$work/status.json" && return; sleep 0.1; done
  die 'it is not tracking within 4 s'
}
refused() { status; python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["commands_refused"])' "$work/status.json"; }

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
open alpha
open mallory
n=0
for _ in $(seq 20); do # until the daemon has heard its autopilot
  ask alpha alpha 1 $((++n)) $enable
  [[ $answer == 0* ]] && break
  sleep 0.25
done
tracks

# A second station; another process under the holder's name and session; the holder's own command, replayed to the byte.
count=$(refused)
expect '2 *alpha*' mallory beta 9 1 $takeoff
expect '2 *alpha*' mallory alpha 1 $((n + 1)) $takeoff
expect '2 *alpha*' mallory alpha 1 $n $enable
(($(refused) >= count + 3)) || die "what was refused was not counted"
holds 's["state"] == "tracking" and not s["armed"]'

# A repeat is answered as before although the daemon would say something else by now; an old number is not answered so.
expect '0 disabling' alpha alpha 1 $((++n)) $disable
sleep 0.5
holds 's["state"] == "passive"'
expect '0 enabling' alpha alpha 1 $((++n)) $enable
tracks
expect '0 enabling' alpha alpha 1 $n $enable # "already tracking" if it were done again
expect '3 *older*' alpha alpha 1 $((n - 1)) $disable
sleep 0.5
holds 's["state"] == "tracking"'

# STOP from whoever sees the need; on the ground and disarmed it disables.
expect '0 *' mallory beta 9 2 $stop_now
sleep 0.5
holds 's["state"] == "passive"'

# The session ends with its process: the next station does not wait for the lease.
expect '0 enabling' alpha alpha 1 $((++n)) $enable
expect '2 *alpha*' mallory beta 9 3 $hold
echo end >&"$in_alpha"
wait "$pid_alpha" 2>/dev/null || true
sleep 1
expect '[01] *' mallory beta 9 4 $hold
# What was recorded of the session that ended is no command of the one that follows.
expect '[23] *' mallory alpha 1 2 $enable

# A name that would write a line of its own into the log, or on a terminal.
expect '*' mallory $'\e[2Jevil' 9 5 $hold
grep -v ' -> ' "$log" | grep -q $'\e' && die "an escape sequence reached the log"

# A second odometry writer: refused, counted and named; the first one's is flown.
holds 's["odometry_refused"] == 0'
"$build/tests/dds_probe" "$domain" backwash second
holds 's["odometry_refused"] > 20 and "is in use" in s["refused"] and abs(s["position"][0] + 2) < 0.1'

# The holder is killed: STOP is taken at once, and 2 s later its session is over.
open gamma
expect '[01] *' mallory beta 9 6 $hold
expect '2 *beta*' gamma gamma 5 1 $hold
kill -KILL "$pid_mallory"
expect '[01] *' gamma gamma 5 2 $stop_now
sleep 4
expect '1 not enabled' gamma gamma 5 3 $hold
holds 's["state"] == "passive"'
expect '0 session released' gamma gamma 5 4 $release

# A second daemon in this name space, for a controller of its own: both would obey one enable. Neither does.
sed -e "s#^device = .*#device = \"$work/absent\"#" -e "s#^file = .*#file = \"$work/rival.bwlog\"#" \
  "$work/backwashd.toml" >"$work/rival.toml"
"$bin/backwashd" --config "$work/rival.toml" >>"$log" 2>&1 &
rival=$!
more_pids+=("$rival")
for _ in $(seq 100); do (($(grep -c 'another daemon in this namespace' "$log") == 2)) && break; sleep 0.1; done
expect '1 another daemon in this namespace, writer *' gamma gamma 6 1 $enable
alone() { grep -c 'no other daemon in this namespace' "$log" || true; }
before=$(alone)
kill -TERM "$rival"
wait "$rival"
for _ in $(seq 100); do (($(alone) > before)) && break; sleep 0.1; done
expect '0 enabling' gamma gamma 6 2 $enable
