#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What a flight of the daemon with a real autopilot does when something goes wrong at speed: one flight a fault.
#   faults.sh ardupilot|px4 PATH_OF_BUILD BUILD_DIR OUT_DIR [FAULT …]
# Prints a row a fault: how far the vehicle went after it, when it was at rest, when disarmed, contacts, and what the daemon
# said. Exits 77 without a build to fly, 1 if a vehicle touched the map, moved on, or a fault was not survived as docs/faults.md
# says.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
kind=$1 path=$2 build=$3 out=$4
shift 4
all=(hold stop land vio_stop vio_freeze vio_jump vio_turn sigstop kill frozen line_off power_off restart pilot battery rc gcs link late streams
  reboot   stop_arming stop_takeoff stop_plan stop_replan stop_land stop_goto
  hold_stop_0.2 hold_stop_0.45 hold_stop_1.0 stop_hold hold_hold door_hold_stop door_hold_goto gap_hold_stop gap_hold_goto vio_gap_stop)
[[ $# -gt 0 ]] || set -- "${all[@]}"
if [[ ! -e $path ]]; then
  echo "skipped: tests/autopilots/faults.sh needs the path of a build of $kind"
  exit 77
fi

if [[ $# -gt 1 ]]; then
  failed=0
  for fault; do bash "$0" "$kind" "$path" "$build" "$out" "$fault" || failed=1; done
  exit "$failed"
fi
fault=$1
# fly_real begins anew in a network namespace: with these arguments, in its order.
if [[ ${BACKWASH_NETNS:-} != own ]]; then
  BACKWASH_NETNS=own exec unshare -n -- bash "$0" "$kind" "$path" "$build" "$out" "$fault"
fi
source "$root/tests/autopilots/flight.sh"

# What the autopilot is set to for a fault. The pilot's switch brings a mode that holds the position: ArduCopter's sixth (LOITER),
# PX4's POSCTL, which needs sticks (its AUTO.LOITER is refused without a global position). Others: SETTINGS=FLTMODE6=17,
# PILOT_MODE=auto:land.
case $kind/$fault in
  ardupilot/pilot) SETTINGS=${SETTINGS:-FLTMODE6=5} ;;
  ardupilot/battery) SETTINGS=${SETTINGS:-BATT_LOW_VOLT=10.5 BATT_LOW_TIMER=1 BATT_FS_LOW_ACT=1} ;;
  ardupilot/rc) SETTINGS=${SETTINGS:-FS_THR_ENABLE=3} ;;
  ardupilot/gcs) SETTINGS=${SETTINGS:-FS_GCS_ENABLE=5 FS_GCS_TIMEOUT=2} ;;
  px4/pilot) SETTINGS=${SETTINGS:-COM_RC_IN_MODE=1} ;;
  px4/battery) SETTINGS=${SETTINGS:-COM_LOW_BAT_ACT=2 CBRK_SUPPLY_CHK=0} ;;
  px4/rc) SETTINGS=${SETTINGS:-COM_RC_IN_MODE=1 COM_RCL_EXCEPT=0 NAV_RCL_ACT=3} ;;
  px4/gcs) SETTINGS=${SETTINGS:-NAV_DLL_ACT=3 COM_DL_LOSS_T=5} ;;
esac
case $kind/$fault in
  */link | */line_off | */late | */streams) RELAY=yes ;;
  ardupilot/battery | ardupilot/gcs) STATION="tcp 5763" ;;
  px4/gcs) STATION="udp 18570" ;;
  px4/rc | px4/pilot) STATION="udp 18570 sticks" ;;
esac
goal=
case $fault in # a gap of 1.0 m, for a body of 0.29 m: 0.2 m to either side, of which a set at rest takes most
  gap_*)
    MAP=${MAP:-builtin:narrow-gap} START=${START:-1.05,0.15,0.32} goal=5.05,0.15,1.2 VEHICLE=$out/$fault/wide.vehicle.toml
    mkdir -p "$out/$fault"
    sed 's/^radius = [0-9.]*/radius = 0.29/; s/^diagonal_radius = [0-9.]*/diagonal_radius = 0.36/' "$root/tests/autopilots/$kind.vehicle.toml" >"$VEHICLE"
    ;;
esac
fly_real "$kind" "$path" "$build" "$out/$fault" ${goal:+"$goal"}

now() { python3 -c "import time; print(time.monotonic())"; }

# look_for EXPRESSION: from now on, in Python, of what the status tells as mode, moving, x, y, z; until it is seen, within 60 s,
# seen() waits and sets them. One process hears all: to start one a look takes longer than a flight where the machine is busy.
look_for() {
  exec 9< <(timeout 60 "$bin/backwashctl" --domain "$domain" "${station[@]}" watch --json 2>>"$log" | python3 -uc 'import json, sys
for line in sys.stdin:
    s = json.loads(line)
    mode, moving, (x, y, z) = s["state"], s["moving"], s["position"]
    if eval(sys.argv[1]):
        print(mode, moving, x, y, z)
        break' "$1")
}
seen() { read -r mode moving x y z <&9; }

# CLOCK_MONOTONIC of the first change of mode since $from, which the log tells in local time.
acted() {
  python3 - "$log" "$from" <<'PYTHON'
import datetime, re, sys, time
lines = open(sys.argv[1]).read().splitlines()[int(sys.argv[2]):]
said = next(m for m in (re.match(r"\[(.*?)\] \[info\] (?:passive|hold|land|quiet): ", line) for line in lines) if m)
print(time.monotonic() - time.time() + datetime.datetime.fromisoformat(said[1]).timestamp())
PYTHON
}

# On the ground, disarmed, under way with the daemon: off for 2 s, then a flight.
reboot() {
  for _ in $(seq 30); do ctl enable --wait && break; sleep 1; done
  from=$(wc -l <"$log")
  { kill -KILL "$autopilot_pid" && wait "$autopilot_pid"; } 2>/dev/null || true
  sleep 2
  "start_$kind" "$path"
  take_off
  at=$(now)
  must land --wait
}

at_speed() { # at_speed [X]: on the way to the goal, beyond that x, m; by itself before the door
  look_for "x > ${1:-4.0}"
  must goto "$goal"
  seen || die "the vehicle did not move"
  [[ $mode == tracking && $moving == True ]] || die "the flight was in $mode before the fault"
  at=$(now)
  since=$at
  from=$(wc -l <"$log")
}

# soon_after SECONDS FIRST SECOND: two commands, so long after one another as their processes start.
soon_after() {
  ctl "$2" &
  sleep "$1"
  must "$3"
  wait $! || die "backwashctl $2 failed"
  at=$(now)
}

inject() {
  case $fault in
    hold_stop_* | *_hold_stop) soon_after "$(case $fault in hold_*) echo "${fault##*_}" ;; *) echo 0.45 ;; esac)" hold stop ;;
    stop_hold) soon_after 0.45 stop hold ;;
    hold_hold) soon_after 0.45 hold hold ;;
    *_hold_goto) # flown on from where the hold came to rest
      must hold --wait
      sleep 2
      must goto "$goal" --wait
      at=$(now)
      ;;
    vio_gap_stop) # longer than a pose may be away, shorter than what lands: the set-point is frozen, and a stop comes
      echo stop >&7
      sleep 0.15
      echo go >&7 && ctl stop || true
      ;;
    hold | stop | land) must "$fault" --wait ;;
    stop_land) must stop && must land ;;
    stop_goto) # stays until a later command
      must stop --wait
      sleep 3
      stays
      at=$(now)
      must goto "$goal" --wait
      must stop
      ;;
    vio_*) echo "$(sed 's/^vio_//; s/^jump$/jump 1 0.5 0/; s/^turn$/turn 1.57/' <<<"$fault")" >&7 ;;
    sigstop) kill -STOP "$autopilot_pid" && sleep 3 && kill -CONT "$autopilot_pid" ;;
    kill | frozen) # what stands still is ended after 3 s, as by systemd's watchdog
      [[ $fault == kill ]] || { kill -STOP "$daemon_pid" && sleep 3; }
      kill -KILL "$daemon_pid"
      sleep 3
      daemon "$vehicle" "$out/again.bwlog"
      ;;
    line_off) echo cut >&8 ;;
    power_off) kill -KILL "$daemon_pid" && echo stop >&7 ;; # the process of the VIO stays: it logs the truth
    restart) # at once, and taken in hand again; the row begins there, that of `kill` tells what is before
      kill -KILL "$daemon_pid"
      daemon "$vehicle" "$out/again.bwlog"
      for _ in $(seq 20); do ctl enable --wait && break; sleep 0.5; done
      at=$(now)
      must land --wait
      ;;
    pilot)
      if [[ $kind == px4 ]]; then
        "$path/bin/px4-commander" mode "${PILOT_MODE:-posctl}" >>"$log" 2>&1
      else
        echo 1900 >"$work/switch"
      fi
      ;;
    late) echo late 0.1 >&8 ;;  # each way
    streams) echo streams >&8 ;;  # a station's on the same line, see relay.py
    link) echo cut >&8 && sleep 3 && echo go >&8 ;;
    rc) if [[ $kind == px4 ]]; then echo sticks >&8; else echo 900 >"$work/throttle"; fi ;;
    *) die "no fault $fault: ${all[*]}" ;;
  esac
}

# What the autopilot acts on only after a while is begun so long before the vehicle is at speed; it counts from when it acts.
slow() {
  if [[ $kind/$fault == px4/gcs ]]; then
    echo quiet >&8
    sleep 2
  fi
  must goto "$goal"
  case $kind/$fault in
    ardupilot/gcs) sleep 3 ;;
    */battery) sleep 3 ;;
  esac
  case $kind/$fault in
    ardupilot/gcs) echo quiet >&8 ;;
    ardupilot/battery) echo "set SIM_BATT_VOLTAGE 10" >&8 ;;
    px4/battery)
      "$path/bin/px4-param" set SIM_BAT_MIN_PCT 0 >>"$log" 2>&1
      "$path/bin/px4-param" set SIM_BAT_DRAIN 1 >>"$log" 2>&1
      ;;
  esac
  look_for 'mode != "tracking"'
  seen || die "the autopilot did nothing"
  at=$(acted)
}

# stop_while_lifting Z: a take-off that is stopped above that height, m, or with 0 as soon as it is accepted. One that did not
# arm is asked for again.
stop_while_lifting() {
  for _ in $(seq 30); do
    ctl enable --wait || true
    from=$(wc -l <"$log")
    look_for "z > $1 or mode == 'passive'"
    if ctl takeoff --height 1.2 && seen && [[ $mode != passive ]]; then break; fi
    sleep 1
  done
  must stop
  at=$(now)
}

# A goto and a stop that overtake each other, six times. Where the stop came last nothing may be flown.
stop_while_planning() {
  local wait last round
  from=$(wc -l <"$log")
  for wait in 0 0.005 0.01 0.02 0.03 0.05; do
    round=$(wc -l <"$log")
    ctl goto "$goal" &
    sleep "$wait"
    must stop
    wait $! || true
    last=$(tail -n +"$((round + 1))" "$log" | grep -o 'from .*: \(planning\|stopping\)$' | tail -n 1)
    echo "a goto, and a stop $wait s later; the daemon heard last: $last" >>"$log"
    [[ $last == *stopping ]] || must stop
    at=$(now)
    sleep 2.5
    stays
  done
}

# The daemon moves nothing for 2 s.
stays() {
  look_for "moving or mode not in ('hold', 'tracking')"
  ! read -t 2 -r <&9 || die "it moved on after a stop"
}

case $fault in
  reboot) reboot ;;
  stop_arming) stop_while_lifting 0 ;;
  stop_takeoff) stop_while_lifting 0.4 ;;
  stop_plan)
    take_off
    stop_while_planning
    ;;
  stop_replan) # in the tick in which a cube of 1 m3 was found on the path, or soon after
    take_off
    at_speed 3.1
    look_for 'mode == "hold"'
    echo "crate 5.0 2.4 1.2 1.0" >&7
    seen || die "the cube was not seen"
    from=$(wc -l <"$log")
    must stop
    at=$(now)
    ;;
  battery | gcs)
    take_off
    from=$(wc -l <"$log")
    slow
    ;;
  door_*) # rest is in the door, 5.8 to 6.0 m
    take_off
    at_speed "${DOOR_AT:-4.1}"
    inject
    ;;
  gap_*) # braking at once would end in it, 2.9 to 3.2 m
    take_off
    at_speed "${GAP_AT:-1.5}"
    inject
    ;;
  *)
    take_off
    at_speed
    inject
    ;;
esac
[[ $fault == *_off ]] && sleep 25 || sleep 15 # ArduCopter lands 8 s after its last ODOMETRY
kill -TERM "$daemon_pid" "$vio_pid" 2>/dev/null || true
wait "$daemon_pid" "$vio_pid" 2>/dev/null || true
said=$(tail -n +"$((from + 1))" "$log" |
  sed -n 's/.*\[info\] \(\(passive\|hold\|land\|quiet\|tracking\|braking here is not clear\|no rest before its end is clear\): .*\)/\1/p' | paste -sd ';')
raw=$(sed -n 's/.* raw log //p' "$log" | tail -n 1)
python3 "$root/tests/autopilots/run_out.py" "$kind" "$fault" "$out/$kind.truth.csv" "$at" \
  "$(sed -n 's/.* contacts \([0-9]*\),.*/\1/p' "$out/$kind.vio.log" | tail -n 1)" "$said" "$raw" "${since:-$at}"
