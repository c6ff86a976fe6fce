#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The command line of ./fly, called from another folder, in a project whose programs only say what they were asked: files are
# the caller's, a vehicle file needs its model, and what is wrong is said before anything is installed or built.
#   fly_line.sh SOURCE_DIR
set -euo pipefail
source_dir=${1:?usage: fly_line.sh SOURCE_DIR}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "$*" >&2; exit 1; }

project=$work/project elsewhere=$work/elsewhere
mkdir -p "$project"/{build/release/services,services/bench} "$elsewhere"
cp "$source_dir/fly" "$project"
cp "$source_dir/services/bench/stalls.sh" "$project/services/bench"
cat >"$project/setup.sh" <<'SH'
install_packages() { touch built; }
build_preset() { :; }
attended() { "$@"; }
SH
cat >"$project/build/release/services/backwash" <<'SH'
#!/usr/bin/env bash
echo "$*, in $PWD" >>"$SAID"
printf '1,2,3\n4,5,6\n'
SH
cat >"$project/services/bench/flight.sh" <<'SH'
#!/usr/bin/env bash
echo "model $model, flight $*" >>"$SAID"
SH
chmod +x "$project"/{build/release/services/backwash,services/bench/flight.sh}
export SAID=$work/said
cd "$elsewhere"
touch own.bt own.toml own.model.toml

# refused CODE WORDS ARGUMENTS…
refused() {
  local code=$1 words=$2 got=0
  shift 2
  rm -f "$project/built"
  "$project/fly" "$@" >"$work/out" 2>&1 || got=$?
  [[ $got == "$code" && $(wc -l <"$work/out") == 1 && $(<"$work/out") == "fly: "*"$words"* ]] ||
    die "./fly $*: wanted $code and one line with '$words', got $got: $(<"$work/out")"
  [[ ! -e $project/built ]] || die "./fly $*: built before it refused"
}
refused 64 "--model" --map own.bt --vehicle own.toml
refused 66 "--map gone.bt" --map gone.bt
refused 66 "--vehicle gone.toml" --map own.bt --vehicle gone.toml --model own.model.toml
refused 64 "--seed -3" --map own.bt --seed -3
refused 64 "--seed one" --map own.bt --seed one
refused 64 "--nonsense" --nonsense 1
refused 64 "--map needs a value" --map
refused 64 "simple, ardupilot or px4" --autopilot plane
refused 64 "--map FILE" --seed 3

# asked WORDS ARGUMENTS…: all of the words are in what the programs were asked.
asked() {
  local words=$1
  shift
  rm -f "$SAID"
  "$project/fly" "$@" >"$work/out" 2>&1 || die "./fly $*: $(<"$work/out")"
  for word in $words; do grep -qF -- "$word" "$SAID" || die "./fly $*: nothing was asked with '$word': $(<"$SAID")"; done
}
asked "$elsewhere/own.bt" --map own.bt
asked "$elsewhere/own.toml $elsewhere/own.model.toml" --map own.bt --vehicle own.toml --model own.model.toml
grep -q "^model $elsewhere/own.model.toml, flight .* own $elsewhere/own.bt 1,2,3 4,5,6 $elsewhere/own.toml 1 simple" "$SAID" ||
  die "the flight is not flown with the files that were given: $(<"$SAID")"
asked "builtin:quad-7in" --map own.bt --vehicle builtin:quad-7in
grep -q "^model builtin:quad-7in," "$SAID" || die "a built-in vehicle does not take its own model: $(<"$SAID")"
asked "--map own.bt $elsewhere" --in-process --map own.bt
"$project/fly" --help | grep -q "set -e" && die "--help shows the script"
exit 0
