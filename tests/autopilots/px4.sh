#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# See flight.sh: PATH_OF_BUILD is PX4's build directory, with bin/px4 and etc/.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
source "$root/tests/autopilots/flight.sh"
fly_real px4 "$@"
judge_flight
