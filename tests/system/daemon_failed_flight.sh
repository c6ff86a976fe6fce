#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A flight that could not be flown to its end has its page, the reason first: services/bench/flight.sh to a goal within a wall.
#   daemon_failed_flight.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=${1:?usage: daemon_failed_flight.sh SOURCE_DIR BUILD_DIR} build=$(realpath "${2:?}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "$*"; cat "$work/said"; exit 1; }

status=0
"$source_dir/services/bench/flight.sh" "$build" "$work" failed builtin:parallel-walls-4m -2,0,1.2 -2,2.05,1.2 >"$work/said" 2>&1 || status=$?
[[ $status == 70 ]] || die "exit $status, 70 was wanted"
grep -q "what was recorded: $work/failed.html" "$work/said" || die "the page is not named"
grep -q 'class="verdict failed">Not good: backwashctl goto failed: .*refused' "$work/failed.html" || die "the page does not begin with the reason"
grep -q 'asked to take off' "$work/failed.html" || die "the page does not tell what was flown"
