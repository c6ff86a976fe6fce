#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Plays a script against a given build of a real autopilot in its own simulator and keeps the trace.
#   script.sh ardupilot|px4 PATH_OF_BUILD BUILD_DIR SCRIPT TRACE [NAME=VALUE …]
# NAME=VALUE: parameters of the autopilot, in place of tests/autopilots' own. Everything on loopback, in a network
# namespace of its own.
set -euo pipefail
if [[ ${BACKWASH_NETNS:-} != own ]]; then
  [[ -e $2 ]] || { echo "skipped: no build of $1 at '$2'"; exit 77; }
  BACKWASH_NETNS=own exec unshare -n -- bash "$0" "$@"
fi
ip link set lo up
name=$1 path=$2 bin=$3/tests script=$4 trace=$5
shift 5
source "$(dirname "${BASH_SOURCE[0]}")/simulators.sh"
"start_$name" "$path" "$@"
[[ $name == px4 ]] && px4=(--px4) || px4=()
status=0
"$bin/autopilot_script" --device "$device" --truth "$truth" --script "$script" --trace "$trace" "${px4[@]}" \
  --pid "$autopilot_pid" || status=$?
[[ $status == 0 ]] || tail -n 30 "$work/autopilot.log" >&2
[[ -z ${KEEP_LOG:-} ]] || cp "$work/autopilot.log" "$KEEP_LOG"
exit "$status"
