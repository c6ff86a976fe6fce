#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The instructions of a plan are those that docs/measurements/costs.md tells, within 3 %: a plan that costs more, or less, is told
# there.
#   plan_instructions.sh BINARY_DIR
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
command -v qemu-x86_64 >/dev/null || { echo "skipped: qemu-user is not there"; exit 77; }
[[ $(uname -m) == x86_64 ]] || { echo "skipped: the figure is that of x86-64"; exit 77; }
told=$(sed -n 's/.*`plan_instructions`.*| \([0-9.]*\) million.*/\1/p' "$source_dir/docs/measurements/costs.md")
row=$(BACKWASH_BUILD=$1 "$source_dir/toolchains/instructions.sh" "$source_dir/tests/bench/apartment_pairs.csv") || exit 1
echo "$row; docs/measurements/costs.md tells ${told:-none}"
awk -v told="$told" '$1 == "x86-64" { counted = $4 } END { exit !(told > 0 && counted > 0.97 * told && counted < 1.03 * told) }' <<<"$row"
