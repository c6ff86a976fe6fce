#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# How often air as modelled is called rougher, and how soon rough air is: 10,000 flights of 120 s without a change, then flights with
# one, in gusts of continuous time (tests/gusts). Exits 1 if a target is missed.
# Usage: adapt.sh BUILD [--form-told] [--flights N] [--changed N] [--seed N] [--jobs N]
set -euo pipefail
build=${1:?usage: adapt.sh BUILD [OPTION …]}
shift
"$build/tests/adapt_gate" "$@"
