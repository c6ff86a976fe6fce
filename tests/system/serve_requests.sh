#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What reaches the door of `backwashctl serve` (page/requests.py): token, host, origin, method and size are asked for; garbage, slow clients
# and floods of strangers (page/floods.py) neither end it nor keep a STOP away; it ends within 2 s. Without a daemon and with one that flies.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
bin=$build/services

# begin: starts serve; $url is what it printed.
begin() {
  "$bin/backwashctl" --domain "$domain" --station page@here --json serve --port 0 --vehicle builtin:quad-5in >"$work/serve.json" 2>>"$log" &
  serve_pid=$!
  more_pids+=($serve_pid)
  for _ in $(seq 100); do [[ -s $work/serve.json ]] && break; sleep 0.05; done
  url=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["url"])' "$work/serve.json")
}
# end SIGNAL CODE: it is gone within 2 s, whoever is connected.
end() {
  local begun=$(date +%s%3N) code=0 took
  kill -"$1" "$serve_pid"
  wait "$serve_pid" || code=$?
  took=$(($(date +%s%3N) - begun))
  [[ $code == "$2" && $took -lt 2000 ]] || die "after SIG$1 serve ended with $code after $took ms"
}
requests() { python3 "$source_dir/tests/system/page/requests.py" "$url" "$serve_pid" "$@" || die "requests $1: not as it shall be"; }

begin
requests alone
port=${url#*:*:} port=${port%%/*}
code=0
timeout 10 "$bin/backwashctl" --domain "$domain" serve --port "$port" >/dev/null 2>"$work/stderr" || code=$?
[[ $code == 71 ]] && grep -q "127.0.0.1:$port cannot be listened on" "$work/stderr" || die "a port in use: $code $(cat "$work/stderr")"
end TERM 143

start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
begin
exec {reader}<>"/dev/tcp/127.0.0.1/$(python3 -c 'import sys, urllib.parse; print(urllib.parse.urlsplit(sys.argv[1]).port)' "$url")"
requests flight "$bin/backwashctl" "$domain"
end INT 130
grep -q "${url#*#}" "$log" && die "the token is in a log"
echo good
