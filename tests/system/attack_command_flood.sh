#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A stranger sends commands as fast as they go (docs/faults.md rows 26 and 28) and so gets the lease. The operator's
# STOPs are taken all the same, each of them; odometry is not starved; the raw log holds what was acted on and not the flood.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
enable
ctl takeoff --height 1.2 --wait
ctl release
before=$(stat -c %s "$work/flight.bwlog")
"$build/tests/attacker" "$domain" flood 6 >"$work/flood" &
more_pids+=($!)
sleep 1
steps=()
for _ in $(seq 20); do steps+=(stop +100); done
"$build/tests/attacker" "$domain" send "${steps[@]}" >"$work/answers" || true
"$bin/backwashctl" --domain "$domain" status --json >"$work/status.json"
wait "${more_pids[-1]}"
sleep 0.5
after=$(stat -c %s "$work/flight.bwlog")
stop
cat "$work/flood" "$work/answers" >>"$log"
python3 - "$work" $((after - before)) <<'PYTHON'
import json, sys
work, grown = sys.argv[1], int(sys.argv[2])
answers = [line.split(maxsplit=3) for line in open(work + "/answers")]
sent = int(open(work + "/flood").read().split()[-2])
status = json.load(open(work + "/status.json"))
print(f"{sent} commands of a stranger, {status['commands_refused']} refused so far; {len(answers)} of 20 STOPs answered; "
      f"the log grew by {grown / 1e6:.1f} MB")
assert sent > 20000, "no flood"
assert len(answers) == 20 and all(a[1] == "stop" and a[2] == "0" for a in answers), answers
assert status["state"] == "hold" and status["reason"] == "operator asks to stop", status
assert status["records_lost"] == 0, status
assert grown < 5e6, "the flood fills the log"
PYTHON
