#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The real-time proofs that need minutes, the wall clock or another compiler. CI calls it nightly.
#   realtime.sh [rtsan] [tsan] [asan] [fuzz] [rtps] [stress] [overload] [flood] [stops] [soak] [wall]      no argument: all of them
# What each part proves, how long it takes: README.md here. Figures: docs/measurements/realtime.md.
set -euo pipefail
script=$(realpath "${BASH_SOURCE[0]}")
cd "$(dirname "$script")/../.."
source ./setup.sh
out=$PWD/build/nightly
mkdir -p "$out"
install_packages packages.txt
install_packages tests/packages.txt

# build DIR TARGET… -- CMAKE_OPTION…
build() {
  local dir=$1 targets=()
  shift
  while [[ $1 != -- ]]; do targets+=("$1"); shift; done
  shift
  cmake -S . -B "$dir" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo \
    -DCMAKE_CXX_FLAGS_RELWITHDEBINFO='-O1 -g1' "$@" >"$out/build.log" 2>&1 &&
    cmake --build "$dir" --target "${targets[@]}" >>"$out/build.log" 2>&1 ||
    { tail -n 40 "$out/build.log" >&2; exit 70; }
}

rtsan() {
  install_packages tests/nightly/packages.txt
  build build/rtsan test_daemon -- -DCMAKE_C_COMPILER=clang-22 -DCMAKE_CXX_COMPILER=clang++-22 \
    -DCMAKE_C_FLAGS='-fsanitize=realtime -w' -DCMAKE_CXX_FLAGS='-fsanitize=realtime -fno-optimize-sibling-calls -w'
  RTSAN_SYMBOLIZER_PATH=/usr/lib/llvm-22/bin/llvm-symbolizer \
    RTSAN_OPTIONS="suppressions=$PWD/tests/nightly/rtsan.supp:halt_on_error=true" build/rtsan/tests/test_daemon
}

tsan() {
  build_preset release --target backwashctl bench dds_probe
  build build/tsan backwashd test_sync -- -DCMAKE_CXX_FLAGS='-fsanitize=thread -w'
  [[ $(nm -C build/tsan/services/backwashd | grep -c '__tsan_read') -gt 0 ]] || { echo "not instrumented" >&2; return 70; }
  # Its first test is that a race in a hand-over is reported.
  TSAN_OPTIONS=exitcode=66 build/tsan/tests/test_sync --gtest_brief=1
  local status=70
  rm -f "$out"/tsan.*
  for _ in 1 2 3; do # 70: no report, but a busy machine ended the flight early
    [[ $status == 70 ]] || break
    status=0
    TSAN_OPTIONS="suppressions=$PWD/tests/nightly/tsan.supp:print_suppressions=1:exitcode=66:log_path=$out/tsan.report" \
      BENCH_NICE=-10 BACKWASHD=$PWD/build/tsan/services/backwashd tests/nightly/tsan_flight.sh build/release "$out" || status=$?
  done
  cat "$out"/tsan.report.* 2>/dev/null || true
  return "$status"
}

# The asan preset, but with assertions and without -O2, which compiles in half the time.
asan_build() {
  build build/asan "$@" -- -DCMAKE_CXX_FLAGS='-fsanitize=address,undefined -fno-omit-frame-pointer -fno-sanitize-recover=all -w'
}

asan() {
  local programs=(types sync files map field reach adapt plan track log sim report study config bridge daemon) status=0
  asan_build "${programs[@]/#/test_}"
  for program in "${programs[@]}"; do build/asan/tests/test_"$program" --gtest_brief=1 || status=$?; done
  return "$status"
}

fuzz() {
  asan_build test_fuzz
  BACKWASH_FUZZ_BYTES=${FUZZ_BYTES:-1e8} build/asan/tests/test_fuzz
}

# In rounds, each with a daemon and a seed of its own.
rtps() {
  build_preset release --target backwashd backwashctl bench rtps_fuzz
  local round packets=${RTPS_PACKETS:-1e7} rounds=${RTPS_ROUNDS:-10}
  for round in $(seq "$rounds"); do
    tests/system/daemon_rtps_fuzz.sh "$PWD" build/release "$(python3 -c "print(int($packets / $rounds))")" "$round"
  done
}

# stops_beside NAME RIGS: STOPS of them, shared by as many daemons, benches and stations side by side.
stops_beside() {
  local rig pids=() status=0
  rm -f "$out/$1".*.ms
  for rig in $(seq "$2"); do
    BENCH_NICE=-10 tests/system/daemon_stop_latency.sh "$PWD" build/release "$((${STOPS:-1000} / $2))" "$out/$1.$rig.ms" &
    pids+=($!)
  done
  for rig in "${pids[@]}"; do wait "$rig" || status=$?; done
  echo "$1, load average $(cut -d' ' -f1-3 /proc/loadavg):"
  cat "$out/$1".*.ms | tests/nightly/stop_quantiles.py || status=$?
  return "$status"
}

# A daemon takes a twentieth of a processor.
stops() {
  install_packages tests/nightly/packages.txt
  build_preset release --target backwashd backwashctl bench station_probe
  local status=0
  stops_beside stops_quiet 4 || status=$?
  stress-ng --cpu "$(nproc)" --timeout 7200 >/dev/null 2>&1 &
  local load=$!
  trap "kill $load 2>/dev/null || true" EXIT # also of a part that is ended from outside
  stops_beside stops_load 4 || status=$?
  kill "$load" 2>/dev/null || true
  wait "$load" 2>/dev/null || true
  return "$status"
}

stress() {
  install_packages tests/nightly/packages.txt
  build_preset release --target backwashd backwashctl bench backwash
  stress-ng --cpu "$(nproc)" --timeout 120 >/dev/null 2>&1 &
  local load=$! status=0
  BENCH_NICE=-10 services/bench/flight.sh build/release "$out" stress builtin:parallel-walls-4m -2,0,1.2 2,0,1.2 || status=$?
  kill "$load" 2>/dev/null || true
  wait "$load" 2>/dev/null || true
  tests/nightly/histograms.py "$out/stress.bwlog" --tick-p99 1000 --lateness-p99 500
  return "$status"
}

overload() {
  build_preset release --target backwashd backwashctl bench
  tests/nightly/overload.sh "$PWD" build/release
}

soak() {
  build_preset release --target backwashd backwashctl bench backwash
  rm -f "$out"/soak.*
  BENCH_NICE=-10 tests/nightly/soak.sh build/release "$out" "${SOAK_SECONDS:-600}"
  tests/nightly/flat.py "$out/soak.rss"
}

flood() {
  build_preset release --target backwashd backwashctl bench dds_probe
  tests/system/daemon_flood.sh "$PWD" build/release
}

wall() {
  build_preset release
  local status=0
  ctest --preset release -R '^(daemon|attack)_' || status=$?
  tests/nightly/wall_faults.sh "$PWD" build/release || status=$?
  return "$status"
}

if [[ ${1:-} == --part ]]; then
  "$2"
  exit
fi
[[ $# -gt 0 ]] || set -- rtsan tsan asan fuzz rtps stress overload flood stops soak wall
failed=()
for part; do
  echo "== $part"
  # In a shell of its own: what fails ends the part, not the night.
  "$script" --part "$part" || failed+=("$part")
done
[[ ${#failed[@]} -eq 0 ]] || { echo "failed: ${failed[*]}" >&2; exit 1; }
