#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# How often good odometry is called drifting, in 10 h of flights and in recordings, and how soon odometry that drifts is
# (docs/faults.md row 57, tests/gusts/drift.cpp). Exits 1 if a good flight is, or a target is missed.
# Usage: drift.sh BUILD [--hours N] [--seed N] [--position E FILE ...]
set -euo pipefail
build=${1:?usage: drift.sh BUILD [OPTION ...]}
shift
"$build/tests/vio_drift" "$@"
