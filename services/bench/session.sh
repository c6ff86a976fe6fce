# SPDX-License-Identifier: BSD-3-Clause
# Sourced by scripts that need the daemon as it flies: backwash-bench (flight controller on a pty, VIO and mapper on DDS)
# and backwashd as processes of their own, in a DDS domain of their own. Whatever is started is stopped when the script ends.
# BACKWASHD: another build of the daemon than the bench's. BENCH_NICE: the bench's niceness (it stands for hardware that
# does not wait for this machine's processors; below 0 needs the right).
# What all of them say goes to $log, which is shown if the script fails, unless start_bench is given a file to keep.

source "$(dirname "${BASH_SOURCE[0]}")/configuration.sh"
bench_pid='' daemon_pid='' more_pids=() work=$(mktemp -d)
ctl_options=() # of every backwashctl, --security for one
log=$work/log
: >"$log"
# Domains above 200 would use port numbers that the system hands out itself.
domain=${BACKWASH_DOMAIN:-$((1 + $$ % 200))}

stop() {
  local pid
  for pid in $daemon_pid $bench_pid "${more_pids[@]}"; do kill -TERM "$pid" 2>/dev/null || true; done
  for pid in $daemon_pid $bench_pid "${more_pids[@]}"; do wait "$pid" 2>/dev/null || true; done
  daemon_pid='' bench_pid='' more_pids=()
}
trap 'status=$?; stop; [[ $status == 0 || $log != "$work/log" ]] || cat "$log" >&2; rm -rf "$work"' EXIT
die() {
  echo "flight: $*; see $log" >&2
  exit 70
}

# start_bench BIN LOG MAP START VEHICLE [OPTION …]
start_bench() {
  bin=$1 log=$2
  local map=$3 start=$4 vehicle=$5
  shift 5
  nice -n "${BENCH_NICE:-0}" "$bin/backwash-bench" --map "$map" --vehicle "$vehicle" --start "$start" --link "$work/autopilot" --domain "$domain" --force \
    "$@" >>"$log" 2>&1 &
  bench_pid=$!
  for _ in $(seq 200); do [[ -e $work/autopilot ]] && return; sleep 0.05; done
  die "the bench did not start"
}

# start_daemon VEHICLE RAW_LOG [ODOMETRY_TOPIC]: returns once it has built its world from the map, or from a mapper's window.
start_daemon() {
  local from=$(wc -l <"$log")
  write_configuration "$@"
  "${BACKWASHD:-$bin/backwashd}" --config "$work/backwashd.toml" >>"$log" 2>&1 &
  daemon_pid=$!
  for _ in $(seq 1200); do
    tail -n +"$((from + 1))" "$log" | grep -Eq 'map accepted|world of the window made' && return
    kill -0 "$daemon_pid" 2>/dev/null || die "the daemon stopped"
    sleep 0.1
  done
  die "the daemon accepted no map"
}

# ctl VERB …: one command of the ground station; its failure ends the script.
# Its own last words are the reason: the daemon writes to the log, too.
ctl() {
  local answer code=0
  answer=$("$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" "$@" 2>&1) || code=$?
  echo "$answer" >>"$log"
  [[ $code == 0 ]] || die "backwashctl $1 failed: $(tail -n 1 <<<"$answer")"
}

# Enables control; a daemon that has just started may not have heard its autopilot yet, or, while others start beside it, not
# for the 1.5 s after which it goes quiet. The vehicle stands disarmed: asking again is safe.
enable() {
  local answer
  for _ in $(seq 40); do
    answer=$("$bin/backwashctl" --domain "$domain" "${ctl_options[@]}" enable --wait 2>&1) && return
    echo "$answer" >>"$log"
    grep -Eq 'refused: no |no heartbeat from the autopilot|pose older than' <<<"$answer" || break
    sleep 0.25
  done
  die "enabling failed: $answer"
}
