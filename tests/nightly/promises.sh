#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# promises.sh [FIRST [LAST]]: the promises as numbers (tests/promises) in blocks FIRST to LAST of a thousand (0 to 999: all), on every
# processor, niced. One block is 10⁴ tubes, 10³ places of rest, 10² plans and 10² updates of a map; ./check draws block 0.
# Blocks that held are kept in $BACKWASH_PROMISES_DONE (promises-COMMIT.done): begun again, it goes on where it was ended.
set -euo pipefail
cd "$(dirname "$(realpath "${BASH_SOURCE[0]}")")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/packages.txt
build_preset release --target test_promises
first=${1:-0} last=${2:-${1:-999}}
export done_file=${BACKWASH_PROMISES_DONE:-promises-$(git rev-parse --short HEAD).done}
touch "$done_file"
seq "$first" "$last" | grep -vxFf <(cut -d' ' -f1 "$done_file") | nice xargs -r -P "${JOBS:-$(nproc)}" -I{} bash -c '
  if out=$(BACKWASH_PROMISES_BLOCK={} build/release/tests/test_promises --gtest_brief=1 2>&1); then
    echo "{} $(date -u +%F)" >>"$done_file"
  else
    printf "block {}:\n%s\n" "$out"; exit 1
  fi' || failed=1
held=$(sort -un "$done_file" | wc -l)
echo "$held of 1000 blocks held: $((held * 10000)) tubes, $((held * 1000)) places of rest, $((held * 100)) plans, $((held * 100)) updates"
exit "${failed:-0}"
