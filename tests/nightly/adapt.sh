#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# How often errors as modelled are called larger, how soon larger ones are, and what is taken for rough air that is none:
# closed loops of their own equations in gusts of continuous time (tests/gusts). Exits 1 if a target is missed.
# Usage: adapt.sh BUILD [--flights N] [--changed N] [--seed N] [--jobs N]
set -euo pipefail
build=${1:?usage: adapt.sh BUILD [OPTION …]}
shift
"$build/tests/adapt_gate" "$@"
