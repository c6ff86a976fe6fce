#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# `backwashctl serve` in a real Chromium during a flight of the real processes (page/flight.cjs): the page sees the vehicle move, its
# HOLD holds and its STOP stops, a second page is read-only, a reloaded one comes back, a silent daemon is said in red within 1 s.
#   serve_page.sh SOURCE_DIR BUILD_DIR [FOLDER_OF_SCREENSHOTS]
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
needs chromium
needs_peers
source "$source_dir/services/bench/session.sh"

start_bench "$build/services" "$log" builtin:thin-wall 2,-3,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
"$bin/backwashctl" --domain "$domain" --json serve --port 0 --vehicle builtin:quad-5in >"$work/serve.json" 2>>"$log" &
serve_pid=$!
more_pids+=($serve_pid)
for _ in $(seq 100); do [[ -s $work/serve.json ]] && break; sleep 0.05; done
url=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["url"])' "$work/serve.json")
printf 'x_m,y_m,z_m\n' >"$work/route.csv"
for _ in 1 2 3 4 5 6; do printf '2,3,1.2\n2,-3,1.2\n' >>"$work/route.csv"; done
HOME=$work nice -n 5 timeout 200 node "$source_dir/tests/system/page/flight.cjs" "$modules" "$url" "$bin/backwashctl" "$domain" "$daemon_pid" "$serve_pid" "$work/route.csv" "${3:-}" ||
  die "the page is not as it shall be"

# Ctrl-C and SIGTERM end it within 2 s, with a page open or not.
begun=$(date +%s%3N) code=0
kill -TERM "$serve_pid"
wait "$serve_pid" || code=$?
took=$(($(date +%s%3N) - begun))
[[ $code == 143 && $took -lt 2000 ]] || die "serve ended with $code after $took ms"
grep -q "${url#*#}" "$log" && die "the token is in a log"
echo "ended after $took ms"
