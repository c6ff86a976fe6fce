#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# With the shipped configuration (dds.interface = "lo") Fast DDS and Cyclone DDS as they come see the topics: where there is
# nothing but loopback, and beside a network whose address they speak by. Each quality that ROS 2's readers ask is matched
# and served, one that is stopped holds up nobody, and each topic says its type's hash. What comes from beyond that network is
# not heard, not even under the name of the vehicle's own odometry.
#   daemon_discovery.sh SOURCE_DIR BUILD_DIR [inside]
set -euo pipefail
source_dir=$1 build=$2
if [[ ${3:-} != inside ]]; then
  source "$source_dir/tests/support/skip.sh"
  own_network "$0" "$source_dir" "$build" inside
fi
source "$source_dir/services/bench/session.sh"
unset CYCLONEDDS_URI FASTRTPS_DEFAULT_PROFILES_FILE
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"

# Each topic out that is sent reliably, by each quality that it serves.
asked=()
while read -r topic type way most; do
  [[ $way == out && $most != sensor ]] || continue
  for qos in sensor default latched; do
    asked+=("$topic" "$type" "$qos")
    [[ $qos != "$most" ]] || break
  done
done < <("$source_dir/tests/support/topics.py" "$source_dir" | sed 's|^|rt/backwash/|'
  echo rt/diagnostics diagnostic_msgs::msg::dds_::DiagnosticArray_ out latched)
# seen WHERE: by both as they come, all that was asked. The status comes 10 times a second.
seen() {
  local reader
  for reader in fastdds cyclone; do
    "$build/tests/${reader}_reader" "$domain" 8 "${asked[@]}" >"$work/seen" 2>>"$log" || die "no $reader reader"
    python3 - "$work/seen" "$source_dir" "$1, $reader" "${asked[@]}" <<'PYTHON' || die "$1, $reader: $(<"$work/seen")"
import pathlib, re, sys
sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv[2] + "/idl")
import type_hashes as t
types = t.types_of(pathlib.Path(sys.argv[2], "idl/ros2.idl").read_text())
types |= t.types_of(pathlib.Path(sys.argv[2], "idl/backwash_msgs.idl").read_text())
asked = sys.argv[4:]
of = {name.rsplit("/", 1)[1]: re.sub(r"(\w+)::msg::dds_::(\w+)_", r"\1/msg/\2", type_) for name, type_ in zip(asked[::3], asked[1::3])}
lines = [re.fullmatch(r"rt/(?:backwash/)?(\w+) (\w+): matched (\d+), (\d+) samples, ([\d.]+) a second, user data (.*)", l.rstrip()) for l in open(sys.argv[1])]
assert len(lines) == len(asked) // 3 and all(lines), lines
for topic, qos, matched, samples, rate, said in (l.groups() for l in lines):
    assert matched == "1", (topic, qos, matched)
    assert said == f"typehash=RIHS01_{t.hash_of(of[topic], types)};", (topic, said)
    wanted = {"status": 10, "diagnostics": 1, "battery": 1}.get(topic)
    assert wanted * 0.5 <= float(rate) <= wanted * 1.12 if wanted else int(samples) <= 1, (topic, qos, samples, rate)
print(f"{sys.argv[3]}: {len(lines)} readers matched, {len({l[1] for l in lines})} topics with their types' hashes")
PYTHON
  done
}
status() { "$bin/backwashctl" --domain "$domain" status --json | python3 -c 'import json, sys; print(json.load(sys.stdin)[sys.argv[1]])' "$1"; }

seen "loopback alone"

# Beside a network: eth to a machine beyond it.
unshare --net sleep 600 &
beyond=$!
more_pids+=("$beyond")
for _ in $(seq 50); do [[ $(readlink /proc/$beyond/ns/net) != "$(readlink /proc/self/ns/net)" ]] && break; sleep 0.1; done
ip link add eth type veth peer name far netns "$beyond"
ip address add 10.99.0.1/24 dev eth
ip link set eth up
there() { nsenter --target "$beyond" --net "$@"; }
there ip address add 10.99.0.2/24 dev far
there ip link set far up
there ip link set lo up
seen "beside a network"

# On a network a process has an index of 0 to 100, and with it a port that an earlier one had: whoever counts addresses
# (door.hpp) knows it.
python3 - "$bin/backwashctl" "$((domain + 1))" <<'PYTHON'
import socket, subprocess, sys
program, domain = sys.argv[1:]
first, held = 7410 + 250 * int(domain), []
def port():
    asked = [program, "--domain", domain, "--interface", "eth", "--timeout", "2", "status"]
    station, seen = subprocess.Popen(asked, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True), set()
    while station.poll() is None:
        bound = {int(line.split()[1].split(":")[1], 16) for line in open("/proc/net/udp").readlines()[1:]}
        seen |= bound & set(range(first, first + 250)) - {s.getsockname()[1] for s in held}
    return seen, station.stderr.read()
def hold(index):
    held.append(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    held[-1].bind(("", first + 2 * index))
for start in range(2):
    seen, said = port()
    assert min(seen, default=0) == first, (start, seen, said)
for index in range(100):
    hold(index)
seen, said = port()
assert min(seen, default=0) == first + 200, (seen, said)
hold(100)
seen, said = port()
assert not seen and "DDS" in said, (seen, said)
print(f"index 0 twice, then 100, then none: {said.strip()}")
PYTHON

# A reader that is stopped, and asks for every sample: the others get theirs.
"$build/tests/fastdds_reader" "$domain" 60 rt/backwash/status backwash_msgs::msg::dds_::Status_ default >/dev/null 2>&1 &
stopped=$!
more_pids+=("$stopped")
sleep 2
kill -STOP "$stopped"
seen "beside a stopped reader"
kill -KILL "$stopped"
wait "$stopped" 2>/dev/null || true

# As the vehicle's odometry, from beyond the network; the same from this machine is heard.
writer=$(sed -n 's/.*odometry is taken from writer //p' "$log" | tail -n 1)
spoof=(python3 "$source_dir/tests/system/spoofed_packets.py" "$domain" "$writer" odometry 10.99.0.1)
[[ $(status odometry_refused) == 0 ]] || die "odometry was refused before"
there "${spoof[@]}"
[[ $(status odometry_refused) == 0 ]] || die "what another machine sent was heard"
there "$build/tests/fastdds_reader" "$domain" 4 rt/backwash/status backwash_msgs::msg::dds_::Status_ sensor >"$work/far" 2>>"$log"
grep -q 'matched 0, 0 samples' "$work/far" || die "another machine reads the status: $(<"$work/far")"
"${spoof[@]}"
sleep 1
(($(status odometry_refused) > 0)) || die "spoofed odometry of this machine was not heard: it proves nothing above"
spoofed=$(status odometry_refused)
# What Fast DDS sends as it comes is heard, too: here it is the second writer of odometry, and refused as that.
FASTDDS_AS_IT_COMES=1 "$build/tests/fastdds_peer" "$domain" rt/backwash/odometry rt/backwash/status -2 0 0.16 4 odometry >"$work/peer" 2>>"$log" ||
  die "the peer read no status"
(($(status odometry_refused) > spoofed + 100)) || die "of the peer's 400 samples $(($(status odometry_refused) - spoofed)) were heard"
[[ $(status refused) == *"is in use"* ]] || die "the peer was refused as another: $(status refused)"
echo "10.99.0.2 was not heard; $spoofed spoofed samples of this machine were, and $(($(status odometry_refused) - spoofed)) of Fast DDS as it comes"
