#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# rt/tf as tf2 itself understands it: map > odom > base_link out of Debian's tf2::BufferCore is the odometry in the map, to 1e-9.
#   daemon_tf2.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/tests/support/skip.sh"
installed tf2_peer tests/packages.txt test -x "$build/tests/tf2_peer"
source "$source_dir/services/bench/session.sh"
start_bench "$build/services" "$log" builtin:parallel-walls-4m -2,0,1.2 builtin:quad-5in --namespace elsewhere
more_dds='tf = "vehicle"'
write_configuration builtin:quad-5in "$work/flight.bwlog"
"$bin/backwashd" --config "$work/backwashd.toml" >>"$log" 2>&1 &
daemon_pid=$!
"$build/tests/tf2_peer" "$domain" 8 >"$work/seen" || die "tf2 sees something else: $(<"$work/seen")"
cat "$work/seen"
grep -q 'Frame base_link exists with parent odom' "$work/seen" && grep -q 'Frame odom exists with parent map' "$work/seen" || die "not the tree"
