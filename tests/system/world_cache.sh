#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# world_cache.sh BACKWASH: a world that was made before is taken from the cache, for equal inputs alone and whole, and says the same.
set -eu
backwash=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export BACKWASH_CACHE=$work/cache
here=$(cd "$(dirname "$0")" && pwd)
map=$here/../data/maps/geb079.bt
one=()
failed=0
fail() {
  echo "FAILED: $1"
  failed=1
}

cp "$here/../../core/config/files/quad-5in.vehicle.toml" "$work/own.toml"

# NAME [ARGUMENT …]: the regions and the way of a vehicle, in $work/NAME.
ask() {
  local name=$1
  shift
  "$backwash" feasibility --map "$map" --model builtin:quad-5in --vehicle "$work/own.toml" --json "${one[@]}" "$@" >"$work/$name" 2>"$work/error" ||
    fail "feasibility ends with $?: $(cat "$work/error")"
}
kept() { find "$work/cache" -type f 2>/dev/null | wc -l; }

BACKWASH_CACHE='' ask without
[[ $(kept) == 0 ]] || fail "something was kept without a folder"
ask first
[[ $(kept) == 1 ]] || fail "$(kept) files after the first world"
[[ $(stat -c %a "$work/cache") == 700 ]] || fail "others may read the folder"
file=$(find "$work/cache" -type f)
touch -d '2001-01-01' "$file"
ask second
[[ $(stat -c %Y "$file") -gt 1000000000 ]] || fail "the kept world was not used"
for name in first second; do
  cmp -s "$work/without" "$work/$name" || fail "$name says something else than a world made anew"
done

# What follows makes 25 worlds: of a third of the map, on one thread, so that each is still worth keeping.
rm -r "$work/cache"
"$backwash" map convert "$map" --crop=-8,-7.5,-0.4,5,8,3 --out "$work/part.bt" --quiet >/dev/null
map=$work/part.bt one=(--threads 1)
ask first
file=$(find "$work/cache" -type f)

# Another vehicle, margin or method is another world.
ask margin --margin 0.2
ask paper --method paper
cp "$work/own.toml" "$work/first.toml"
sed -i 's/^radius = .*/radius = 0.17/' "$work/own.toml"
grep -q '^radius = 0.17' "$work/own.toml" || fail "the vehicle file has no radius to change"
ask wide
[[ $(kept) == 4 ]] || fail "$(kept) files after four different worlds"
for name in margin paper wide; do
  if cmp -s "$work/first" "$work/$name"; then fail "$name says what the first one says"; fi
done

# Damaged, cut, swapped or unreadable files are worlds made anew.
cp "$file" "$work/good"
size=$(stat -c %s "$file")
cp "$work/first.toml" "$work/own.toml"
ask anew
cmp -s "$work/first" "$work/anew" || fail "the first vehicle's world has changed"
for at in 0 3 20 90 150 200 $((size / 2)) $((size - 1)); do
  cp "$work/good" "$file"
  printf '\xa5' | dd of="$file" bs=1 seek="$at" conv=notrunc status=none
  touch -d '2001-01-01' "$file"
  ask damaged
  cmp -s "$work/good" "$file" || fail "a file damaged at byte $at was not made anew"
  cmp -s "$work/anew" "$work/damaged" || fail "a file damaged at byte $at was believed"
done
for length in 0 10 145 200 $((size - 11)); do
  head -c "$length" "$work/good" >"$file"
  ask cut
  cmp -s "$work/anew" "$work/cut" || fail "a file cut at byte $length was believed"
done
for other in "$work"/cache/*.backwash-world; do [[ $other == "$file" ]] || cp "$other" "$file"; done
ask swapped
cmp -s "$work/anew" "$work/swapped" || fail "the world of another vehicle was believed"
# What others could have put there is not read, and what is not ours is not removed.
chmod 777 "$work/cache"
touch -d '2001-01-01' "$file"
ask shared
[[ $(stat -c %Y "$file") -lt 1000000000 ]] || fail "a world in a folder that others can write was used"
chmod 700 "$work/cache"
truncate -s 600M "$work/cache/$(printf '%064d' 2).backwash-world.part-7"
touch -d '1999-01-01' "$work/cache/"*.part-7
for n in 0 1; do truncate -s 600M "$work/cache/$(printf '%064d' $n).backwash-world"; done
truncate -s 600M "$work/cache/gazebo.world"
touch -d '2000-01-01' "$work/cache/"*000.backwash-world "$work/cache/gazebo.world"
touch -d '2002-01-01' "$work/cache/"*001.backwash-world
rm "$file"
ask full
[[ -e $file ]] || fail "nothing is kept in a full folder"
[[ ! -e $work/cache/$(printf '%064d' 0).backwash-world ]] || fail "the folder holds more than a gibibyte"
[[ -e $work/cache/$(printf '%064d' 1).backwash-world ]] || fail "more was removed than had to be"
[[ ! -e $work/cache/$(printf '%064d' 2).backwash-world.part-7 ]] || fail "what a killed call left stays for ever"
[[ -e $work/cache/gazebo.world ]] || fail "another program's file was removed"
rm "$work/cache/gazebo.world" "$file"
mkdir "$file"
ask folder
cmp -s "$work/anew" "$work/folder" || fail "a folder in a world's place changed the answer"
BACKWASH_CACHE=/proc/none ask nowhere
BACKWASH_CACHE=/dev/null ask device
for name in nowhere device; do cmp -s "$work/anew" "$work/$name" || fail "$name: another answer"; done
exit $failed
