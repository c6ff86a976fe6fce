#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The real-time proofs that need minutes, the wall clock or another compiler. CI calls it nightly.
#   realtime.sh [rtsan] [tsan] [stress] [soak] [wall]      no argument: all of them
# rtsan   every lockstep test with clang's RealtimeSanitizer around each tick
# tsan    the hand-overs, and a whole flight of the daemon under a 10 kHz flood, with ThreadSanitizer
# stress  a flight with stress-ng on all processors: tick p99 <= 1 ms, wake-up p99 <= 500 us (SCHED_FIFO), histograms
# soak    SOAK_SECONDS (600) of flying to and fro, each leg planned anew: resident memory flat
# wall    the fault rows and flights through the real processes, on the wall clock
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/nightly/packages.txt
out=$PWD/build/nightly
mkdir -p "$out"

# build DIR TARGET… -- CMAKE_OPTION…
build() {
  local dir=$1 targets=()
  shift
  while [[ $1 != -- ]]; do targets+=("$1"); shift; done
  shift
  cmake -S . -B "$dir" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_COMPILER_LAUNCHER=ccache \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO='-O1 -g1' "$@" >"$out/build.log" 2>&1 &&
    cmake --build "$dir" --target "${targets[@]}" >>"$out/build.log" 2>&1 ||
    { tail -n 40 "$out/build.log" >&2; exit 70; }
}

rtsan() {
  build_preset release --target backwashctl bench dds_probe
  build build/tsan backwashd test_sync -- -DCMAKE_CXX_FLAGS='-fsanitize=thread -w'
  [[ $(nm -C build/tsan/services/backwashd | grep -c '__tsan_read') -gt 0 ]] || { echo "not instrumented" >&2; return 70; }
  # Its first test is that a race in a hand-over is reported.
  TSAN_OPTIONS=exitcode=66 build/tsan/tests/test_sync --gtest_brief=1
  local status=0
  rm -f "$out"/tsan.*
  TSAN_OPTIONS="suppressions=$PWD/tests/nightly/tsan.supp:print_suppressions=1:exitcode=66:log_path=$out/tsan.report" \
    BENCH_NICE=-10 BACKWASHD=$PWD/build/tsan/services/backwashd tests/nightly/tsan_flight.sh build/release "$out" || status=$?
  cat "$out"/tsan.report.*
  return "$status"
}

stress() {
  build_preset release --target backwashd backwashctl bench backwash
  stress-ng --cpu "$(nproc)" --timeout 120 >/dev/null 2>&1 &
  local load=$! status=0
  services/bench/flight.sh build/release "$out" stress builtin:parallel-walls-4m -2,0,1.2 2,0,1.2 || status=$?
  kill "$load" 2>/dev/null || true
  wait "$load" 2>/dev/null || true
  tests/nightly/histograms.py "$out/stress.bwlog" --tick-p99 1000 --lateness-p99 500
  return "$status"
}

soak() {
  build_preset release --target backwashd backwashctl bench backwash
  rm -f "$out"/soak.*
  BENCH_NICE=-10 tests/nightly/soak.sh build/release "$out" "${SOAK_SECONDS:-600}"
  tests/nightly/flat.py "$out/soak.rss"
}

wall() {
  build_preset release
  ctest --preset release -R '^daemon_'
}

[[ $# -gt 0 ]] || set -- rtsan tsan stress soak wall
for part; do
  echo "== $part"
  "$part"
done
