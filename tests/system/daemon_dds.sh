#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What other participants may do to a daemon, with real processes (docs/faults.md rows 7, 10 to 12, 27, 28, 48): two
# vehicles in one domain, a foreign type, unknown frames, oversized clouds, corrupt and huge maps, maps of a second
# writer; and the preflight.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
status() { "$bin/backwashctl" --domain "$domain" --namespace "$1" status --json >"$work/$1.json"; }
expect() { # expect NAMESPACE 'PYTHON EXPRESSION OVER s'
  status "$1"
  python3 -c 'import json, sys; s = json.load(open(sys.argv[1])); assert eval(sys.argv[2]), (sys.argv[2], s)' "$work/$1.json" "$2"
}

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --parameter NAV_DLL_ACT=2
start_daemon builtin:quad-5in "$work/flight.bwlog"

# daemon NAME PORT: another daemon, whose name space is NAME.
daemon() {
  sed -e "s/namespace = .*/namespace = \"$1\"/" -e "s#rt/backwash/odometry#rt/$1/odometry#" \
    -e "s#^device = .*#device = \"$2\"#" -e "s#^file = .*#file = \"$work/$1.bwlog\"#" \
    "$work/backwashd.toml" >"$work/$1.toml"
  "$bin/backwashd" --config "$work/$1.toml" >>"$log" 2>&1 &
  more_pids+=($!)
}

# A second vehicle in the same domain: its own bench and daemon, elsewhere in the same map. A third without any bench.
"$bin/backwash-bench" --map builtin:parallel-walls-4m --start 1,0,1.2 --link "$work/second" --domain "$domain" \
  --namespace second >>"$log" 2>&1 &
more_pids+=($!)
for _ in $(seq 100); do [[ -e $work/second ]] && break; sleep 0.05; done
daemon second "$work/second"
daemon third "$work/absent"

# The preflight finds the one parameter that is unsafe, and says what to do about it.
sleep 6
if "$bin/backwashctl" --domain "$domain" check >"$work/check" 2>&1; then cat "$work/check"; die "check passed"; fi
cat "$work/check"
[[ $(grep -c ^FAIL "$work/check") == 1 ]] && grep -q '^FAIL  NAV_DLL_ACT: 2 -> set NAV_DLL_ACT' "$work/check" ||
  die "check did not name NAV_DLL_ACT alone"

enable
expect backwash 's["state"] == "tracking" and abs(s["position"][0] + 2) < 0.1'
expect second 's["state"] == "passive" and abs(s["position"][0] - 1) < 0.1 and s["maps_accepted"] == 1'

probe() { "$build/tests/dds_probe" "$domain" "${2:-backwash}" "$1" || die "dds_probe $1 failed"; }
probe foreign
expect backwash 's["foreign_writers"] == 3 and s["state"] == "tracking"'
for why in 'odometry has the type backwash_msgs::msg::dds_::Command_, expected nav_msgs::msg::dds_::Odometry_' \
  'loop_closure is best effort, expected reliable' 'map is volatile, expected transient local'; do
  grep -q "refused: writer [0-9a-f:]* of rt/backwash/$why: it is not listened to" "$log" || die "not refused as that: $why"
done
probe frame
expect backwash 's["odometry_refused"] > 0 and s["odometry_rejected"] == 0 and s["state"] == "tracking"'
# The middleware's own buffer (1 MB) loses each of these on a busy machine; ours is what the kernel gives, counted twice by it.
most=$(cat /proc/sys/net/core/rmem_max 2>/dev/null || echo 0)
[[ $most -lt $((32 << 20)) ]] || most=$((32 << 20))
ss -uanmp | grep -A1 '"backwashd"' | grep -o 'rb[0-9]*' | tr -d rb | sort -n | head -1 |
  { read -r least && [[ $least -ge $((2 * most)) ]] || die "a socket's buffer has $least bytes, of twice $most"; }
probe oversized
expect backwash '1 <= s["scans_rejected"] <= 5 and s["scans_accepted"] == 0'
grep -q 'refused: point cloud: 400000 points, at most' "$log" || die "the oversized cloud was not refused as that"
sleep 1.1  # one warning a second is written
probe lying
expect backwash 's["scans_rejected"] >= 6 and s["scans_accepted"] == 0 and s["state"] == "tracking"'
grep -q 'refused: point cloud: its sizes do not agree: 1000 x 1 points of 12 bytes, rows of 12000, data of 12' "$log" ||
  die "the cloud with false sizes was not refused as that"
# A good map, but not of the writer whose maps are used.
probe roomy
expect backwash 's["maps_rejected"] == 1 and s["maps_accepted"] == 1 and s["state"] == "tracking"'
expect backwash '"a map of writer" in s["refused"] and "is in use" in s["refused"]'

# Where nobody's are used yet, each is judged, and one that is refused binds nobody.
probe elsewhere third
expect third 's["maps_rejected"] == 1 and s["maps_accepted"] == 0'
grep -q "refused: the map is in frame 'odom', expected 'map'" "$log" || die "the map of another frame was not refused as that"
probe corrupt third
expect third 's["maps_rejected"] == 3 and s["maps_accepted"] == 0'
accepted() { # accepted N: the third daemon has taken so many maps
  for _ in $(seq 200); do status third; grep -Eq "\"maps_accepted\": ?$1" "$work/third.json" && return; sleep 0.1; done
  die "the third daemon has not accepted map $1: $(<"$work/third.json")"
}
"$build/tests/dds_probe" "$domain" third roomy 600 & # until it is killed: a mapper that crashes
mapper=$!
accepted 1
# The mapper that follows says its map once, while the first one is not yet known to be gone.
"$build/tests/dds_probe" "$domain" third roomy 600 &
more_pids+=($!)
for _ in $(seq 50); do status third; grep -Eq '"maps_rejected": ?4' "$work/third.json" && break; sleep 0.1; done
expect third 's["maps_accepted"] == 1 and s["maps_rejected"] == 4'
kill -KILL "$mapper"
accepted 2
expect second 's["foreign_writers"] == 0 and s["odometry_refused"] == 0 and s["maps_rejected"] == 0'
ctl stop --wait
