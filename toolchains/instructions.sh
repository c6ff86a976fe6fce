#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Instructions a plan, of x86-64 and of AArch64, as qemu-user counts them: how many, not how long they take.
#   toolchains/instructions.sh PAIRS.csv [V]     V: limit of speed, default 1.5 m/s. Of x86-64 after
#                                                `cmake --build --preset release --target plan_timings`, and of AArch64 where
#                                                `toolchains/build.sh aarch64 plan_timings` has built it
# The mean over every pair but the first: the difference to a run of the first pair alone, so that starting and building the
# world do not count.
set -euo pipefail
[[ $# -ge 1 && -r $1 ]] || { sed -n '4,6s/^# \{0,1\}//p' "$0" >&2; exit 64; }
command -v qemu-aarch64 >/dev/null && command -v qemu-x86_64 >/dev/null || { echo "instructions: needs Debian's qemu-user" >&2; exit 69; }
pairs=$1 v=${2:-1.5} build=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/build
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
gcc -O2 -shared -fPIC -o "$work/count.so" "$(dirname "${BASH_SOURCE[0]}")/count.c"
# A pair is many rows: pieces of the other planner's way, after its number in the fifth column.
first=$(awk -F, 'NR == 2 { print $5 }' "$pairs")
awk -F, -v first="$first" 'NR == 1 || $5 == first' "$pairs" >"$work/one.csv"
more=$(($(awk -F, 'NR > 1 { print $5 }' "$pairs" | sort -u | wc -l) - 1))
# counted FILE COMMAND …
counted() { "${@:2}" --pairs "$1" --v "$v" --calls 1 --json 2>&1 >/dev/null | awk '/^instructions / { print $2 }'; }
# plans NAME COMMAND …
plans() {
  local all one
  all=$(counted "$pairs" "${@:2}") one=$(counted "$work/one.csv" "${@:2}")
  awk -v name="$1" -v d=$((all - one)) -v n="$more" 'BEGIN { printf "%-8s %6d plans  %6.2f M instructions a plan\n", name, n, d / n / 1e6 }'
}
plans x86-64 qemu-x86_64 -cpu max -plugin "$work/count.so" "${BACKWASH_BUILD:-$build/release}/tests/bench/plan_timings"
arm=$build/aarch64/tests/bench/plan_timings
[[ ! -x $arm ]] || plans aarch64 qemu-aarch64 -plugin "$work/count.so" -L "$build/sysroot-aarch64" "$arm"
