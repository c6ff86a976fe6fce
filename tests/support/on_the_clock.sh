#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A test of real processes on the wall clock: it goes before what only computes, where that is allowed. If it fails while this machine
# stood still, that says nothing (services/bench/stalls.sh): it is tried up to three times more, and skipped if all that says nothing.
#   on_the_clock.sh SCRIPT [ARGUMENT …]
set -euo pipefail
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/skip.sh"
source "$here/../../services/bench/stalls.sh"
renice -n -10 -p $$ >/dev/null 2>&1 || true
metered=$(mktemp -d)
trap 'rm -rf "$metered"' EXIT
name=$metered/$(basename "$1" .sh) status=0
twice twice tried "$name" "$@" 2>&1 | tee "$name.log" || status=$?
[[ $status -ne $says_nothing ]] || skip stalled "$(grep 'says nothing' "$name.log" | tail -n 1)"
exit "$status"
