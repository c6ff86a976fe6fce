#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A ground station behind a bad line: 30 % loss, 50 to 100 ms of delay, 1 Mbit/s (bad_link.py; below row 46 of docs/faults.md). A map
# arrives, or both ends are told how far it came; commands come through beside it, and the vehicle's own odometry does not notice.
#   daemon_bad_link.sh SOURCE_DIR BUILD_DIR [BYTES]     BYTES: of a further map, whose time is told (5 minutes for 20900000)
set -euo pipefail
source_dir=$1 build=$2 large=${3:-}
if [[ ${4:-} != inside ]]; then
  source "$source_dir/tests/support/skip.sh"
  own_network tun "$0" "$source_dir" "$build" "$large" inside
fi
source "$source_dir/services/bench/session.sh"
unset CYCLONEDDS_URI
bin=$build/services
unshare --net sleep 3600 &
vehicle=$!
more_pids+=("$vehicle")
while [[ $(readlink "/proc/$vehicle/ns/net") == $(readlink /proc/self/ns/net) ]]; do sleep 0.05; done
nsenter -t "$vehicle" -n ip link set lo up
python3 "$source_dir/tests/system/bad_link.py" "$vehicle" >"$work/line" &
line=$!
more_pids+=("$line")
until grep -q ready "$work/line"; do kill -0 "$line" || die "no line"; sleep 0.05; done
PYTHONDONTWRITEBYTECODE=1 python3 "$source_dir/tests/system/noise_map.py" "$work/noise.bt" 350000

# on_vehicle COMMAND …: in the vehicle's network.
on_vehicle() { exec nsenter -t "$vehicle" -n -- "$@"; }
ground() { "$bin/backwashctl" --domain "$domain" --interface tun0 --timeout 20 "$@"; }
aboard() { nsenter -t "$vehicle" -n -- "$bin/backwashctl" --domain "$domain" --interface tun0 "$@"; }

(on_vehicle "$bin/backwash-bench" --map builtin:parallel-walls-4m --vehicle builtin:quad-5in --start=-2,0,1.2 --link "$work/autopilot" \
  --domain "$domain" --interface tun0 --namespace bench --force) >>"$log" 2>&1 &
bench_pid=$!
until [[ -e $work/autopilot ]]; do kill -0 "$bench_pid" || die "no bench"; sleep 0.05; done
interface=tun0 more_tables=$'[map]\nmax_mib = 64' write_configuration builtin:quad-5in "$work/flight.bwlog" rt/bench/odometry
(on_vehicle "$bin/backwashd" --config "$work/backwashd.toml") >"$work/daemon" 2>&1 &
daemon_pid=$!
until grep -q 'backwashd runs' "$work/daemon"; do kill -0 "$daemon_pid" || die "no daemon: $(<"$work/daemon")"; sleep 0.05; done

# A map that is flown in.
ground map builtin:parallel-walls-4m >"$work/answer" 2>&1 || die "the small map: $(<"$work/answer")"
cat "$work/answer"
until grep -q 'map accepted' "$work/daemon"; do sleep 0.1; done
for _ in $(seq 20); do aboard enable --wait >>"$log" 2>&1 && break; sleep 0.25; done
aboard status --json >"$work/before"
begun=$(date +%s%N)

# A line that dies on the way: the sender gives up and says where it was, and so does the daemon.
ground map "$work/noise.bt" --patience 3 >"$work/answer" 2>&1 &
sender=$!
until (($(grep -c 'begins to arrive' "$work/daemon") > 1)); do kill -0 "$sender" || die "$(<"$work/answer")"; sleep 0.05; done
sleep 1.5
kill -STOP "$line"
code=0
wait "$sender" || code=$?
kill -CONT "$line"
tail -n 1 "$work/answer"
[[ $code == 69 ]] || die "exit code $code of a map that did not arrive"
grep -Eq 'not arrived: a map of 0\.[0-9] MiB in [0-9]+ parts; [0-9]+ were sent in [0-9]+ s, [1-9][0-9]* are acknowledged .*none in the last [3-9] s.*--patience.*--rate.*--resolution' \
  "$work/answer" || die "it does not say how far it came: $(<"$work/answer")"

# The same again, whole, and a command beside it that is answered. Its snapshot would be too large: it is refused by name.
ground map "$work/noise.bt" >"$work/answer" 2>&1 &
sender=$!
sleep 2
asked=$(date +%s%N)
ground hold >>"$log" 2>&1 || true # refused or not: it is answered
grep -q 'no daemon answered' "$log" && die "a command beside the map was not answered"
echo "a command beside the map: answered after $((($(date +%s%N) - asked) / 1000000)) ms"
code=0
wait "$sender" || code=$?
tail -n 1 "$work/answer"
[[ $code == 69 ]] && grep -q 'refused: too large: its snapshot would need more than 64 MiB (map.max_mib)' "$work/answer" ||
  die "exit code $code of the whole map: $(<"$work/answer")"
grep -Eq 'a map of 0\.[0-9] MiB in parts of writer .* is whole after' "$work/daemon" || die "the daemon has not got it whole"

if [[ -n $large ]]; then
  PYTHONDONTWRITEBYTECODE=1 python3 "$source_dir/tests/system/noise_map.py" "$work/large.bt" "$large"
  begun_large=$(date +%s)
  ground map "$work/large.bt" >"$work/answer" 2>&1 || true
  cat "$work/answer"
  grep -q 'refused: too large' "$work/answer" || die "the large map: $(tail -n 1 "$work/answer")"
  grep 'is whole after' "$work/daemon" | tail -n 1
  echo "the large map took $(($(date +%s) - begun_large)) s with reading it"
fi
took=$((($(date +%s%N) - begun) / 1000000))
aboard status --json >"$work/after"
stop
cat "$work/line"
python3 - "$work" "$took" <<'PYTHON' || die "$(<"$work/daemon")"
import json, re, sys
work, took_s = sys.argv[1], int(sys.argv[2]) * 1e-3
one, two = (json.load(open(f"{work}/{f}")) for f in ("before", "after"))
heard = two["odometry_received"] - one["odometry_received"]
print(f"{took_s:.0f} s: {heard / took_s:.1f} poses a second, {two['ticks_missed'] - one['ticks_missed']} ticks missed, {two['state']}")
assert heard > 47.5 * took_s, "the odometry on the vehicle suffers"  # one a tick is taken
assert two["state"] == one["state"] == "tracking", (one["state"], two["state"])
told = [l for l in open(work + "/daemon") if re.search(r"refused: a map of .* [1-9]\d* of \d+ parts came in .*(its sender is gone|none in the last|another began in its place)", l)]
assert told, "the operator is not told of the map that did not arrive"
print(told[0].strip())
PYTHON
