#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Who may speak (docs/faults.md row 29), with real processes. A station commands a flight from take-off to landing while
# all others try: a process without credentials, one of another authority, an observer, one whose certificate was revoked
# or has ended. Nobody's odometry is taken but the VIO's, and plain packets under its name change nothing. Those who obey no
# rule of their own (no_permissions.c, a clock set back, a list of revoked certificates that is not there) are refused by
# the daemon; the permitted are served meanwhile.
#   daemon_security.sh SOURCE_DIR BUILD_DIR encrypt|sign
set -euo pipefail
source_dir=$1 build=$2 protect=$3
source "$source_dir/services/bench/session.sh"
bin=$build/services keys=$work/keys no_permissions=$build/tests/libno_permissions.so
set_back=(env "LD_PRELOAD=$build/tests/libclock_shim.so" "CLOCK_SHIM=$work/hour") # its processes' clock, by an hour
python3 -c 'import struct, sys; open(sys.argv[1], "wb").write(struct.pack("<q", -3600))' "$work/hour"
credentials() { "$bin/backwash" keys "$@" >>"$log" || die "backwash keys $*"; }
credentials init "$keys" --protect "$protect"
credentials add "$keys" drone --role vehicle
credentials add "$keys" eyes --role vio
credentials add "$keys" guest --role observer
for name in pilot lost; do credentials add "$keys" "$name" --role station; done
credentials revoke "$keys" lost
rm "$keys/lost/crl.pem" # or its own program would refuse it
credentials init "$work/others" --protect "$protect"
credentials add "$work/others" stranger --role station
more_dds="security = \"$keys/drone\""

# as WHO VERB …: a command by a station of that name and those credentials, if it has any; what it said is in $said.
how=(env)
as() {
  local who=$1 folder=''
  [[ ! -d $keys/$who ]] || folder=$keys/$who
  [[ ! -d $work/others/$who ]] || folder=$work/others/$who
  shift
  code=0
  said=$("${how[@]}" "$bin/backwashctl" --domain "$domain" --station "$who" --timeout 3 ${folder:+--security "$folder"} "$@" 2>&1) || code=$?
  echo "$who $*: $code $(tail -n 1 <<<"$said")" >>"$log"
}
taken() { grep -q "command [0-9]* from $1: " "$log"; }
unheard() { # unheard WHO VERB …: the daemon neither answers nor hears it
  as "$@"
  [[ $code == 69 && $said == *'no daemon answered'* ]] || die "$1 was answered: $said"
  ! taken "$1" || die "the daemon heard $1"
}
run_daemon() { # run_daemon NAME: until it knows whether there is another daemon
  local from=$(wc -l <"$log")
  write_configuration builtin:quad-5in "$work/$1.bwlog"
  "$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
  daemon_pid=$!
  for _ in $(seq 100); do
    sleep 0.1
    ! tail -n +"$((from + 1))" "$log" | grep -q 'no other daemon' || return 0
  done
  die 'the daemon does not run'
}

# Odometry and maps of one who may command and nothing else: its own program refuses, and without that none arrives.
code=0
said=$("$bin/backwash-bench" --map builtin:parallel-walls-4m --start -2,0,1.2 --link "$work/autopilot" --domain "$domain" --security "$keys/pilot" 2>&1) || code=$?
[[ $code == 78 && $said == *'the permissions of its credentials do not allow it'* ]] || die "a bench sends what it may not: $code $said"
bench=("$bin" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --log "$work/truth.csv")
LD_PRELOAD=$no_permissions start_bench "${bench[@]}" --security "$keys/pilot"
run_daemon first
sleep 1
as pilot enable
[[ $code == 69 && $said == *'no map was received'* ]] || die "enabled by another's odometry: $said"
as pilot status --json
[[ $said == *'"odometry_received": 0,'* && $said == *'"odometry_refused": 0,'* && $said == *'"maps_rejected": 0,'* ]] || die "another's odometry: $said"
kill -TERM "$bench_pid" && wait "$bench_pid"
rm -f "$work/autopilot"

# The VIO's own: the same daemon takes both.
start_bench "${bench[@]}" --security "$keys/eyes"
for _ in $(seq 100); do grep -q 'map accepted' "$log" && break; sleep 0.1; done
ctl_options=(--security "$keys/pilot")
enable
ctl takeoff --height 1.2 --wait
as nobody status
[[ $code == 69 ]] || die "one without credentials sees the status: $said"
as stranger status
[[ $code == 69 ]] || die "one of another authority sees the status: $said"
as guest status
[[ $code == 0 && $said == *'quad-5in: tracking'* ]] || die "an observer does not see the status: $said"
as guest stop
[[ $code == 69 && $said == *'the permissions of its credentials do not allow it'* ]] || die "an observer may command: $said"

# On its way to the goal it is told to stop by all who may not; STOP would be anybody's. Meanwhile the wire is looked at.
ctl goto 2,0,1.2
python3 - "$protect" >>"$log" <<'PYTHON' || die 'what is on the wire is not as it is protected'
import socket, sys, time
try:
    lo = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
except PermissionError:
    sys.exit(print("not root: the wire was not looked at"))
lo.bind(("lo", 0))
lo.settimeout(0.1)
packets, end = [], time.monotonic() + 1
while time.monotonic() < end:
    packets.append(lo.recv(65536))
plain = sum(b"base_link" in p for p in packets)
print(f"{len(packets)} packets of 1 s, {plain} with odometry in plain text")
assert len(packets) > 100 and (plain > 20) == (sys.argv[1] == "sign") and (plain == 0) == (sys.argv[1] == "encrypt"), plain
PYTHON
unheard nobody stop
unheard stranger stop
unheard lost stop
how=(env "LD_PRELOAD=$no_permissions")
unheard guest stop
as pilot hold # the hostile library lets through who may
[[ $code == 0 ]] || die "the station was not heard: $said"
how=(env)
ctl goto 2,0,1.2 --wait
ctl land --wait

# In plain text under the VIO's own name: neither what it says is heard, nor that it is gone.
spoof() { python3 "$source_dir/tests/system/spoofed_packets.py" "$domain" "$(sed -n 's/.*odometry is taken from writer //p' "$log" | tail -n 1)" "$1"; }
status() { as pilot status --json && python3 -c 'import json, sys; print(json.loads(sys.argv[1])[sys.argv[2]])' "$said" "$1"; }
bound() { grep -c 'odometry is taken from writer' "$log"; }
refused=$(status odometry_refused) writers=$(bound)
spoof odometry
spoof gone
spoof key # the daemon would be dead
sleep 1
[[ $(status odometry_refused) == "$refused" ]] || die 'plain odometry under the name of the VIO was heard'
[[ $(bound) == "$writers" && $(status odometry_age_s) == 0.0* ]] || die 'the VIO was lost by a plain packet under its name'

# A certificate that ends: heard until then, also by a process that does not look at its clock; not after.
credentials add "$keys" ended --role station --until "$(date -u -d '+12 seconds' +%Y-%m-%dT%H:%M:%SZ)"
cp -r "$keys/ended" "$keys/late"
"${set_back[@]}" "$bin/backwashctl" --domain "$domain" --security "$keys/ended" watch --json >"$work/watched" 2>>"$log" &
more_pids+=($!)
as ended stop
taken ended || die "one whose certificate counts was not heard: $said"
sleep 13
as late stop
[[ $code == 78 && $said == *'certificate has expired'* ]] || die "an expired certificate is used: $said"
watched=$(wc -l <"$work/watched")
how=("${set_back[@]}")
unheard late stop
[[ $(wc -l <"$work/watched") == "$watched" ]] && ((watched > 20)) || die "one whose certificate ended still sees the status"
stop

# Without security both are heard: the odometry as what it is, of a frame that nobody has.
rm -rf "$keys" "$work/autopilot"
more_dds='' ctl_options=() writers=$(bound)
start_bench "${bench[@]}"
run_daemon open
for _ in $(seq 100); do (($(bound) > writers)) && break; sleep 0.1; done
writers=$(bound)
spoof gone
for _ in $(seq 100); do (($(bound) > writers)) && break; sleep 0.1; done
(($(bound) > writers)) || die 'a spoofed end was not heard without security: it proves nothing above'
spoof odometry
(($(status odometry_refused) > 0)) || die 'spoofed odometry was not heard without security: it proves nothing above'
stop
grep -E "packets of 1 s|not root" "$log"
echo "$protect: one station commanded take-off, flight and landing; all others and another's odometry were not heard"
