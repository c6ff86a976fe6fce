#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A test is skipped for what this machine cannot do, never for what a command of ours did wrong or ./check forgot to install:
# setup.sh, tests/support/skip.sh and skipped.py, with an npm and an apt-get that fail here.
#   skips.sh SOURCE_DIR
set -euo pipefail
source_dir=${1:?usage: skips.sh SOURCE_DIR}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "$*; said: $(cat "$work/said")" >&2; exit 1; }
# expect CODE WORDS COMMAND …: how it ends, and what it says.
expect() {
  local code=0
  "${@:3}" >"$work/said" 2>&1 || code=$?
  [[ $code -eq $1 ]] && grep -qF -- "$2" "$work/said" || die "${*:3}: exit code $code, not $1 with '$2'"
}
mkdir -p "$work"/{bin,build,tests/support,tests/peers}
cp "$source_dir/setup.sh" "$work/"
cp "$source_dir/tests/support/skip.sh" "$work/tests/support/"
echo '{}' >"$work/tests/peers/package.json"
echo "no-such-package" >"$work/packages.txt"
cd "$work"
export PATH=$work/bin:$PATH
ours() { bash -c "source ./setup.sh; $*"; }
test_of() { bash -c "source tests/support/skip.sh; $*"; }

# What fails although its registry answers is ours; without an answer, the tests that need it are skipped, and say why.
for tool in npm apt-get; do
  printf '#!/bin/sh\n[ "$1" = ping ] || [ "$2" = update ] && exit $(cat "%s/answers")\necho "an option that is none"\nexit 1\n' "$work" >bin/$tool
  chmod +x bin/$tool
done
for install in install_peers 'install_packages packages.txt'; do
  : >build/lacking
  echo 0 >answers
  expect 70 "an option that is none" ours "$install"
  [[ ! -s build/lacking ]] || die "$install: an error of ours is a reason to skip"
  echo 1 >answers
  expect 77 "network: " ours "$install"
  expect 77 "skipped: network: " test_of needs_peers
  expect 77 "skipped: network: " test_of needs no-such-program
done
: >build/lacking
expect 1 "no-such-program is not there: ./check installs it (tests/packages.txt)" test_of needs no-such-program
expect 1 "tests/peers/package.json" test_of needs_peers
expect 77 "skipped: device: no TPM" test_of skip device no TPM

# What fails on the wall clock fails, unless this machine stood still: then it is tried up to three times more, and skipped.
mkdir -p services/bench
cp "$source_dir/tests/support/on_the_clock.sh" tests/support/
cp "$source_dir/services/bench/stalls.sh" services/bench/
echo 'stalls() { cat "$stood_still" >"$1"; exec sleep 60; }' >>services/bench/stalls.sh # in place of a machine that stands still
export stood_still=$work/stood_still
printf '#!/bin/sh\nsleep 0.3\necho tried | tee -a tries\nexit $(head -n $(wc -l <tries) codes | tail -n 1)\n' >timed
chmod +x timed
# timed MS CODES CODE WORDS: on a machine that stood still so long, a test that ends so at each try.
timed() {
  echo "$1" >stood_still
  tr ' ' '\n' <<<"$2" >codes
  rm -f tries
  expect "$3" "$4" tests/support/on_the_clock.sh "$work/timed"
  [[ $(wc -l <tries) -eq $(wc -l <codes) ]] || die "$*: $(wc -l <tries) tries"
}
timed 5 1 1 tried
timed 180 0 0 tried
timed 180 "1 0" 0 "this machine stood still for 180 ms"
timed 180 "1 1 1 0" 0 "this machine stood still for 180 ms"
timed 180 "1 1 1 1" 77 "skipped: stalled: timed: this machine stood still for 180 ms"

# ctest's results: each skipped test gives a kind of reason, and is in the list.
case_of() { echo "<testcase name=\"$1\" status=\"notrun\"><skipped/><system-out>$2</system-out></testcase>"; }
results() { echo "<testsuite><testcase name=\"fine\" status=\"run\"/>$*</testsuite>" >tests.xml; }
echo "a_test  this machine has none" >list
judge="$source_dir/tests/support/skipped.py"
results "$(case_of a_test 'skipped: device: /dev/net/tun')"
expect 0 "skipped: a_test: device: /dev/net/tun" "$judge" . list
results "$(case_of a_test 'skipped: needs the npm registry')"
expect 1 "a_test: no reason" "$judge" .
results "$(case_of another 'skipped: right: root')"
expect 0 "another: right: root" "$judge" .
expect 1 "another: right: root <- FAILED: not in list" "$judge" . list
expect 1 "another: right: root <- FAILED: not in list" "$judge" . list --again
results "$(case_of a_test 'skipped: device: none')$(case_of b_test 'skipped: stalled: b_test: 180 ms')$(case_of c_test 'skipped: stalled: 9 ms')"
expect 1 "c_test: stalled: 9 ms <- FAILED: not in list" "$judge" . list
[[ $("$judge" . list --again 2>/dev/null) == '^b_test$|^c_test$' ]] || die "not to be tried again: $("$judge" . list --again)"
results '<testcase name="wrong" status="fail"><failure/></testcase>'"$(case_of c_test 'skipped: stalled: 9 ms')"
[[ $("$judge" . list --again 2>/dev/null) == '^c_test$|^wrong$' ]] || die "not to be tried again: $("$judge" . list --again)"
results "$(case_of a_test 'skipped: device: none')"
[[ -z $("$judge" . list --again 2>/dev/null) ]] || die "nothing is to be tried again"
printf 'test_%d reason\n' 1 2 3 4 5 6 >list
expect 1 "five at most" "$judge" . list
