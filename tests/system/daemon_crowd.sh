#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A ROS 2 system beside the vehicle (crowd.cpp): a process of 1,500 endpoints of other topics, and one of eight participants with
# 1,600. The last endpoint of each participant is one that the daemon wants; a station that joins then commands a flight.
source "$(dirname "${BASH_SOURCE[0]}")/processes.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in
start_daemon builtin:quad-5in "$work/flight.bwlog"
resident() { awk '/VmRSS/ { print $2 }' "/proc/$daemon_pid/status"; }
before=$(resident) crowds=()
for size in "1 1500" "8 200"; do
  CYCLONEDDS_URI='<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General></Domain></CycloneDDS>' \
    "$build/tests/crowd" "$domain" $size 40 >"$work/crowd ${size% *}" 2>>"$log" &
  crowds+=($!) more_pids+=($!)
done
for n in 1 8; do
  for _ in $(seq 300); do [[ ! -s "$work/crowd $n" ]] || break; sleep 0.1; done
done
sleep 3
enable
ctl takeoff --height 1.2 --wait
ctl goto 0,0,1.2 --wait
ctl land --wait
for pid in "${crowds[@]}"; do wait "$pid" || die "a crowd ended"; done
for n in 1 8; do
  tail -n 1 "$work/crowd $n"
  grep -q "^$n of $n readers" "$work/crowd $n" || die "endpoints that the daemon wants were lost"
done
echo "resident $(((($(resident) - before)) / 1024)) MiB more"
