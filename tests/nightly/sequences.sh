#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sequences of events into the daemon in lockstep (tests/fuzz/sequence), BACKWASH_FUZZ_TICKS (1e8) of them from a seed
# that is new each night (BACKWASH_FUZZ_SEED; printed), on every processor; and reports of BACKWASH_FUZZ_REPORTS (1000) logs.
set -euo pipefail
cd "$(dirname "$(realpath "${BASH_SOURCE[0]}")")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/packages.txt
build_preset release --target test_sequence_fuzz
export BACKWASH_FUZZ_TICKS=${BACKWASH_FUZZ_TICKS:-1e8} BACKWASH_FUZZ_SEED=${BACKWASH_FUZZ_SEED:-$(date +%s)000}
export BACKWASH_FUZZ_REPORTS=${BACKWASH_FUZZ_REPORTS:-1000}
echo "seed $BACKWASH_FUZZ_SEED"
shards=(Shard/SequenceFuzz.BreaksNoPromise/{0..3} Once/SerialLine.BreaksNoPromiseEither/0 Reports.TellEachLogThatTheDaemonWrote)
printf '%s\n' "${shards[@]}" |
  xargs -P "$(nproc)" -I{} build/release/tests/test_sequence_fuzz --gtest_brief=1 --gtest_filter={}
