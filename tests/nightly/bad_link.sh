#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A map of 20 MiB to a flying daemon over a line of 1 Mbit/s with 30 % loss and 50 to 100 ms of delay (tests/system/daemon_bad_link.sh,
# tests/system/bad_link.py): how long it takes, and what the vehicle's odometry notices. 5 to 6 minutes.
#   bad_link.sh SOURCE_DIR BUILD_DIR [BYTES]
set -euo pipefail
exec "$(dirname "$0")/../system/daemon_bad_link.sh" "$1" "$2" "${3:-20900000}"
