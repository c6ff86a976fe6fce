#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# See flight.sh: PATH_OF_BUILD is the source tree of ArduPilot, with build/sitl/bin/arducopter in it.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
source "$root/tests/autopilots/flight.sh"
fly_real ardupilot "$@"
judge_flight
