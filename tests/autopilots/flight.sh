# SPDX-License-Identifier: BSD-3-Clause
# Sourced by ardupilot.sh and px4.sh: one flight of the daemon with a given build of a real autopilot in its own
# simulator, with our VIO fed by that simulator's truth: take off, fly through builtin:apartment's door, land.
#   NAME.sh PATH_OF_BUILD [BUILD_DIR [OUT_DIR [GOAL]]]
# VIO_RATE: Hz of the odometry, which the daemon is told less a tenth; without it as the truth comes, about 100 Hz.
# LINE_BAUD: the daemon's line to the autopilot carries no more than this. TABLES: further tables of the daemon's file.
# SECURITY=encrypt|sign: everybody speaks with credentials. MAP, START, HEIGHT: another map, where the vehicle stands in it,
# to what height it takes off. CRATE="X Y Z EDGE": a cube that is scanned once the vehicle is at speed.
# Exits 77 without a build to fly, otherwise with the judgement of `backwash report`, or 1 after a contact.

fly_real() {
  name=$1 path=${2:-} build=${3:-$root/build/release} out=${4:-} goal=${5:-7.4,3.0,1.2}
  if [[ -z $path || ! -e $path ]]; then
    echo "skipped: tests/autopilots/$name.sh needs the path of a build of $name"
    exit 77
  fi
  if [[ ${BACKWASH_NETNS:-} != own ]]; then
    BACKWASH_NETNS=own exec unshare -n -- bash "$0" "$path" "$build" "$out" "$goal"
  fi
  ip link set lo up
  source "$root/tests/autopilots/simulators.sh"
  source "$root/services/bench/configuration.sh"
  bin=$build/services domain=7 model=builtin:quad-5in
  out=${out:-$work/out}
  mkdir -p "$out"
  log=$out/$name.log
  : >"$log"
  local settings=()
  [[ -z ${SETTINGS:-} ]] || read -ra settings <<<"$SETTINGS"
  "start_$name" "$path" "${settings[@]}"
  [[ -z ${RELAY:-}${LINE_BAUD:-} ]] || relay
  [[ -z ${STATION:-} ]] || helper ground_station.py $STATION
  more_tables=${TABLES:-}
  [[ -z ${VIO_RATE:-} ]] || more_tables+=$'\n[odometry]\nrate_least = '$(python3 -c "print(0.9 * $VIO_RATE)")
  [[ -z ${SECURITY:-} ]] || credentials
  vehicle=${VEHICLE:-$root/tests/autopilots/$name.vehicle.toml}
  mkfifo "$work/faults"
  exec 7<>"$work/faults"
  "$build/tests/autopilot_vio" --truth "$truth" --map "${MAP:-builtin:apartment}" --vehicle "$vehicle" --start "${START:-3.0,4.2,0.26}" \
    --yaw "${MAP_YAW:-0.6}" --rate "${VIO_RATE:-0}" --domain "$domain" --log "$out/$name.truth.csv" "${eyes[@]}" <&7 >"$out/$name.vio.log" 2>&1 &
  vio_pid=$!
  pids+=("$vio_pid")
  daemon "$vehicle" "$out/$name.bwlog"
}

# Of the vehicle, its VIO and a station, by the daemon's own program.
eyes=() station=()
credentials() {
  local keys=$work/keys role
  "$bin/backwash" keys init "$keys" --protect "$SECURITY" >>"$log"
  for role in vehicle vio station; do "$bin/backwash" keys add "$keys" "$role" --role "$role" >>"$log"; done
  more_dds="security = \"$keys/vehicle\""
  eyes=(--security "$keys/vio") station=(--security "$keys/station")
}

# helper SCRIPT [ARGUMENT …]: one of the Python helpers beside this file; it hears what is written to descriptor 8.
helper() {
  mkfifo "$work/helper"
  exec 8<>"$work/helper"
  fifo python3 "$here/$1" "${@:2}" <&8 >>"$log" 2>&1 &
  pids+=($!)
}

# The daemon's line goes through relay.py.
relay() {
  if [[ -n ${LINE_BAUD:-} ]]; then baud=$LINE_BAUD more_link='share = 0.95'; fi
  if [[ $name == px4 ]]; then
    helper relay.py udp 14540 14541 ${LINE_BAUD:-}
    device=udpin:127.0.0.1:14541
  else
    helper relay.py tcp 5760 5770 ${LINE_BAUD:-}
    device=tcp:127.0.0.1:5770
  fi
}

die() {
  echo "flight: $*; see $log" >&2
  tail -n 20 "$log" >&2
  exit 70
}

# daemon VEHICLE RAW_LOG: writes its configuration and starts it; the map, or what of it is around the vehicle, may take a
# minute to be ready.
daemon() {
  write_configuration "$1" "$2"
  local before
  before=$(wc -l <"$log")
  "$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
  daemon_pid=$!
  pids+=("$daemon_pid")
  for _ in $(seq 1200); do
    tail -n +"$((before + 1))" "$log" | grep -Eq 'map accepted|can be flown' && return
    kill -0 "$daemon_pid" 2>/dev/null || die "the daemon stopped"
    sleep 0.1
  done
  die "the daemon accepted no map"
}

ask() { "$bin/backwashctl" --domain "$domain" "${station[@]}" "$@" 2>>"$log"; }
ctl() { ask "$@" >>"$log"; }
must() { ctl "$@" || die "backwashctl $* failed: $(tail -n 1 "$log")"; }

# Both refuse for a while: ArduCopter arms when its gyros have settled. A take-off that is refused leaves the daemon enabled.
# An estimate that was reset on the ground is held there until `land`.
take_off() {
  for n in $(seq 30); do
    ctl enable --wait || true
    ctl takeoff --height "${HEIGHT:-1.2}" --wait && break
    [[ $n != 30 ]] || die "no take-off: $(tail -n 1 "$log")"
    ! tail -n 8 "$log" | grep -q 'land ends it' || ctl land --wait || true
    sleep 1
  done
}

# To the goal; the rest of a large map may still be made.
go() {
  for _ in $(seq 60); do
    ctl goto "$goal" --wait && return
    tail -n 4 "$log" | grep -q 'ask again' || break
    sleep 1
  done
  die "not at the goal"
}

# Until it hovers there, if it does: a hold on the way ends the command, and the planner goes on by itself.
at_goal() {
  for _ in $(seq 120); do
    ask status --json | python3 -c 'import json, math, sys
s = json.load(sys.stdin)
at = math.dist(s["setpoint"], [float(x) for x in sys.argv[1].split(",")]) < 0.01
sys.exit(not (s["state"] == "tracking" and not s["moving"] and at))' "$goal" && return
    sleep 0.5
  done
  return 1
}

# The flight itself, after fly_real: enable, take off, go, land, judge.
judge_flight() {
  take_off
  if [[ -n ${CRATE:-} ]]; then
    must goto "$goal"
    sleep 3
    echo "crate $CRATE" >&7
    at_goal || die "not at the goal: $(ask status)"
  else
    go
  fi
  sleep 3
  ask status --json >"$out/$name.status.json" || die "no status at the goal"
  must land --wait
  kill -TERM "$daemon_pid" "$vio_pid"
  wait "$daemon_pid" "$vio_pid" 2>/dev/null || true
  tail -n 1 "$out/$name.vio.log"
  grep -q ' contacts 0,' "$out/$name.vio.log" || die "the vehicle touched the map"
  "$bin/backwash" report --log "$(sed -n 's/.* raw log //p' "$log" | tail -n 1)" --truth "$out/$name.truth.csv" --vehicle "$vehicle" \
    --model builtin:quad-5in --out "$out/$name.html" --force || [[ -n ${CRATE:-} ]]  # of a route that was cut short it says: missed
  grep -q '"samples_outside": 0,' "$out/$name.status.json" || die "samples outside their sets"
}
