#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The stated memory of a window that moves (docs/interfaces.md, "A window that moves"), against what a real daemon takes while
# its window goes 200 m along a corridor: the most resident memory, above what it had before the first cloud.
#   window_memory.sh SOURCE_DIR BUILD_DIR [METRES]
set -euo pipefail
source_dir=$1 build=$2 metres=${3:-200}
source "$source_dir/services/bench/session.sh"
keep=262144
more_tables="[map.window]
occupied = \"rt/backwash/window_occupied\"
free = \"rt/backwash/window_free\"
size_x = 4
size_y = 4
size_z = 3
resolution = 0.1
keep_voxels = $keep"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --namespace elsewhere
write_configuration builtin:quad-5in "$work/flight.bwlog"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
mkfifo "$work/go"
"$build/tests/window_walker" "$domain" backwash 4,4,3 "$metres" 4 <"$work/go" >"$work/walked" &
walker=$!
more_pids+=("$walker")
exec 3>"$work/go"
for _ in $(seq 100); do grep -q 'odometry is taken' "$log" && break; sleep 0.1; done
sleep 2
resident() { awk '/^VmRSS/ {print $2 * 1024}' "/proc/$daemon_pid/status"; }
before=$(resident)
echo go >&3
while kill -0 "$walker" 2>/dev/null; do
  kill -0 "$daemon_pid" 2>/dev/null || die "the daemon ended"
  echo "$(tail -n 1 "$work/walked" | cut -d' ' -f2) $(resident)" >>"$work/memory"
  sleep 0.2
done
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
python3 - "$work" "$before" "$keep" "$metres" <<'PYTHON'
import json, re, sys
work, before, keep, metres = sys.argv[1], *map(float, sys.argv[2:])
rows = [tuple(map(float, line.split())) for line in open(work + "/memory") if len(line.split()) == 2]
window, world = (41, 41, 31), (60, 60, 45)
product = lambda v: v[0] * v[1] * v[2]
parts = product([(n + 14) // 16 + 1 for n in window])
stated = (keep / 4096 + parts) * 4208 + 512 * product(window) + 2 * 115 * product(world)
most = lambda low, high: max(rss for at, rss in rows if low * metres <= at <= high * metres) - before
mib = lambda b: f"{b / 2**20:.1f} MiB"
status = json.load(open(work + "/status.json"))
said = open(work + "/log").read()
worlds, let_go = said.count("world of the window made"), sum(int(n) for n in re.findall(r"window: (\d+) voxels far from it are let go", said))
print(f"{rows[-1][0]:.0f} m, {status['scans_accepted']} clouds, {worlds} worlds, {let_go} voxels let go: at most {mib(most(0, 1))} above {mib(before)}, "
      f"{most(0, 1) / stated:.2f} of the stated {mib(stated)}; first half {mib(most(0, 0.5))}, last quarter {mib(most(0.75, 1))}")
print("by each eighth of the way:", ", ".join(mib(most(n / 8, (n + 1) / 8)) for n in range(8)))
assert rows[-1][0] > 0.9 * metres and worlds > 10 and let_go > 1e5 and status["scans_accepted"] > metres / 2, (rows[-1], worlds, let_go)
assert most(0, 1) <= stated, "more than stated"
# The allocator takes a while until it reuses all: 16.7 and 16.8 MiB.
assert most(0.75, 1) <= 1.25 * most(0, 0.5), "it grows with the way"
PYTHON
