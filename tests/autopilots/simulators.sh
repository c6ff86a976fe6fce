# SPDX-License-Identifier: BSD-3-Clause
# Sourced: starts a given build of ArduPilot or PX4 with its own simulator, in the network namespace that the caller has
# made. Each sets autopilot_pid, device (of its MAVLink line) and truth (see truth.hpp), and writes into $work.

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
pids=()
work=$(mktemp -d)
end() {
  local pid
  for pid in "${pids[@]}"; do kill -CONT "$pid" 2>/dev/null || true; kill -TERM "$pid" 2>/dev/null || true; done
  sleep 0.3
  for pid in "${pids[@]}"; do kill -KILL "$pid" 2>/dev/null || true; done
  [[ ! -d ${out:-} || ! -e $work/autopilot.log ]] || cp "$work/autopilot.log" "$out"
  rm -rf "$work"
}
trap end EXIT

# The simulator must keep up with real time on a busy machine; without the right it runs as it is.
fifo() { chrt -f 50 true 2>/dev/null && exec chrt -f 50 "$@"; exec "$@"; }

# start_ardupilot SOURCE_TREE [NAME=VALUE …]: ArduCopter's SITL, built there.
start_ardupilot() {
  local tree=$1 setting
  shift
  cp "$here/ardupilot.parm" "$work/own.parm"
  for setting; do echo "${setting%%=*} ${setting#*=}" >>"$work/own.parm"; done
  rm -rf "$work/ardupilot"
  mkdir "$work/ardupilot"
  (cd "$work/ardupilot" && fifo "$tree/build/sitl/bin/arducopter" --model quad --speedup 1 --wipe \
    --home 47.3977,8.5456,488,0 --serial0 tcp:0 --serial1 tcp:2 \
    --defaults "$tree/Tools/autotest/default_params/copter.parm,$work/own.parm") >"$work/autopilot.log" 2>&1 </dev/null &
  autopilot_pid=$! device=tcp:127.0.0.1:5760 truth=tcp:127.0.0.1:5762
  pids+=("$autopilot_pid")
  for _ in $(seq 100); do grep -q 'bind port 5762' "$work/autopilot.log" && break; sleep 0.1; done
  [[ -e $work/switch ]] || sticks
}

low_byte_first() { printf '\\x%02x\\x%02x' $(($1 & 255)) $(($1 >> 8)); }

# The pilot's sticks in the middle (16 channels of 1500 µs): a mode of the pilot's would otherwise get no throttle. The third is
# the throttle, the fifth the switch of modes, as $work/throttle and $work/switch have them.
sticks() {
  local middle value throttle mode
  middle=$(printf '\\xdc\\x05%.0s' $(seq 11))
  echo 1500 | tee "$work/switch" >"$work/throttle"
  (
    while :; do
      read -r value <"$work/throttle" && throttle=$(low_byte_first "$value")
      read -r value <"$work/switch" && mode=$(low_byte_first "$value")
      printf '\xdc\x05\xdc\x05'"$throttle"'\xdc\x05'"$mode$middle" >/dev/udp/127.0.0.1/5501 || true
      sleep 0.1
    done
  ) 2>/dev/null &
  pids+=($!)
}

# start_px4 BUILD_DIR [NAME=VALUE …]: PX4 with its SIH quadrotor, or with $model_of_px4, another simulator's. In about one
# start of three its estimator never makes a first step (`ekf2 status`: 0 updates), whatever else runs: then it is started
# again.
start_px4() {
  local attempt
  for attempt in $(seq 10); do
    begin_px4 "$@"
    for _ in $(seq 30); do
      "$1/bin/px4-ekf2" status 2>&1 | grep -q 'attitude: 1' && return
      sleep 0.1
    done
    echo "PX4's estimator did not begin: start $attempt" >&2
    { kill -KILL "$autopilot_pid" && wait "$autopilot_pid"; } 2>/dev/null || true
  done
}

begin_px4() {
  local build=$1 setting
  shift
  rm -rf "$work/px4" "$work/silence"
  mkdir "$work/px4"
  mkfifo "$work/silence"
  exec 6<>"$work/silence"  # its shell spins on a standard input that has ended
  (
    cd "$work/px4"
    while read -r setting; do
      export "PX4_PARAM_${setting?}"                                  # 1.16 and later read these,
      echo "param set ${setting%%=*} ${setting#*=}" >>px4-rc.params  # 1.15 this
    done < <(grep -v '^#' "$here/px4.params"; printf '%s\n' "$@" | grep .)
    export PATH=$work/px4:$build/bin:$PATH PX4_SIM_MODEL=${model_of_px4:-sihsim_quadx}
    [[ $PX4_SIM_MODEL != sihsim* ]] || export PX4_SIMULATOR=sihsim
    fifo "$build/bin/px4" -d "$build/etc"
  ) >"$work/autopilot.log" 2>&1 <&6 &
  autopilot_pid=$! device=udpin:127.0.0.1:14540 truth=/tmp/px4-sock-0
  pids+=("$autopilot_pid")
  for _ in $(seq 300); do grep -q 'Startup script returned successfully' "$work/autopilot.log" && break; sleep 0.1; done
}
