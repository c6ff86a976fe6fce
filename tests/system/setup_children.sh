#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# setup.sh and services/bench/stalls.sh, of ./fly and ./check: a Ctrl-C ends every child within 2 s, also those that ignore it or
# do not want to go; the progress of a build; a flight on a machine that stood still is flown once more and has its own exit code.
#   setup_children.sh SOURCE_DIR
set -euo pipefail
source_dir=${1:?usage: setup_children.sh SOURCE_DIR}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "$*" >&2; exit 1; }

cat >"$work/like_fly" <<SH
#!/usr/bin/env bash
set -euo pipefail
source "$source_dir/setup.sh"
stubborn() { trap '' INT TERM; touch "$work/\$1"; for n in \$(seq 600); do sleep 0.1; done; }
(stubborn a; true) &
attended bash -c 'sleep 60 & echo >"$work/b"; wait'
SH
for signal in INT TERM; do
  rm -f "$work"/{a,b}
  setsid env --default-signal=INT bash "$work/like_fly" 2>"$work/said" &
  script=$!
  for _ in $(seq 100); do [[ -e $work/a && -e $work/b ]] && break; sleep 0.1; done
  [[ -e $work/a && -e $work/b ]] || die "the children did not start"
  begun=$(date +%s%N)
  (for _ in $(seq 15); do sleep 0.1; done; date +%s%N >"$work/patience") & # how long this machine takes for the patience of end_children
  patience=$!
  kill -"$signal" "$script" # to the script alone, not to its group as a terminal does
  code=0
  wait "$script" || code=$?
  wait "$patience"
  patience=$((($(<"$work/patience") - begun) / 1000000))
  # What the last of them had just started may end by itself.
  while left=$(ps -o pid=,args= --sid "$script" | grep -v defunct); do
    [[ $((($(date +%s%N) - begun) / 1000000)) -lt 10000 ]] || break
    sleep 0.05
  done
  took=$((($(date +%s%N) - begun) / 1000000))
  [[ $code -eq 130 && $(<"$work/said") == interrupted ]] || die "$signal: exit code $code, said: $(<"$work/said")"
  [[ -z $left ]] || die "$signal left $left"
  echo "$signal: all gone after $took ms"
  [[ $took -lt $((patience * 5 / 3)) ]] || die "$signal took $took ms, 15 times 0.1 s here $patience ms"
done

source "$source_dir/setup.sh"
trap - INT TERM HUP
said=$( (for n in $(seq 0 20); do echo "[$n/20] Building something"; done; echo "ninja: done") | show building 2>&1)
[[ $(wc -l <<<"$said") -eq 10 && $said == *"building: 2 of 20, about"*"building: 20 of 20, about 0 min 0 s left" ]] || die "progress: $said"

source "$source_dir/services/bench/stalls.sh"
stalls "$work/stall" &
meter=$!
for _ in $(seq 100); do [[ -s $work/stall ]] && break; sleep 0.1; done
kill -STOP "$meter"
sleep 0.3
kill -CONT "$meter"
for _ in $(seq 100); do (($(cat "$work/stall") >= 250)) && break; sleep 0.1; done
(($(cat "$work/stall") >= 250)) || die "a stall of 0.3 s was told as $(<"$work/stall") ms"
kill "$meter"
stalls() { echo "$stood_still" >"$1"; exec sleep 60; } # in place of a machine that stands still
flights=0
flight() { # fails WANTED times
  flights=$((flights + 1))
  echo "$line" >"$work/flight.log"
  sleep 0.2
  return $((flights <= wanted ? 1 : 0))
}
# expect CODE FLIGHTS: of a flight as $stood_still, $line and $wanted say
expect() {
  local code=0
  flights=0
  twice tried "$work/flight" flight 2>"$work/said" || code=$?
  [[ $code -eq $1 && $flights -eq $2 ]] || die "stood still $stood_still ms, '$line', $wanted failures: code $code, $flights flights"
}
line='a sample lay outside' stood_still=5
wanted=0 && expect 0 1
wanted=9 && expect 1 1 # the flight's own fault: not flown again, and told as it is
stood_still=180
wanted=0 && expect 0 1
wanted=1 && expect 0 2
wanted=9 && expect 75 2
grep -q 'flight: this machine stood still for 180 ms: the flight says nothing' "$work/said" || die "said: $(<"$work/said")"
stood_still=5 line='flight: the daemon accepted no map; see x'
nproc() { echo 0; }
cut() { echo 1; }
wanted=9 && expect 75 2
cut() { echo 0; }
wanted=9 && expect 1 1
echo "a flight that says nothing is flown once more"
