#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A flight through the apartment's doorway with the bench's profile of a real autopilot, judged from the raw log.
#   daemon_autopilots.sh SOURCE_DIR BUILD_DIR ardupilot|px4
set -euo pipefail
source_dir=$1 build=$2 autopilot=$3
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
"$source_dir/services/bench/flight.sh" "$build" "$out" "$autopilot" builtin:apartment 3.0,4.2,1.2 7.4,3.0,1.2 \
  builtin:quad-5in 1 "$autopilot" || { cat "$out/$autopilot.log"; exit 1; }
