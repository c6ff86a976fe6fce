#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The calibration's figures from simulated flight logs: hover campaigns in the three corridors and in scenes that are not
# fitted, for both vehicles, at three quantiles; then the real recordings, if they are there.
# Usage: calibrate.sh BACKWASH [FLIGHTS_PER_CORRIDOR [WORK_FOLDER]]. Prints one table; exits 1 if a target is missed.
set -euo pipefail
backwash=${1:?usage: calibrate.sh BACKWASH [FLIGHTS] [FOLDER]}
flights=${2:-20}
work=${3:-$(mktemp -d)}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
mkdir -p "$work"

# spec FILE START LOW HIGH COUNT: a grid of hovers of 9 s (1 s settling, four windows), moved by up to 3 cm.
spec() {
  printf 'start = %s\nstrength_sd = 0.35\n[grid]\nlow = %s\nhigh = %s\ncount = %s\njitter = 0.03\ndwell = 9.0\n' \
    "$2" "$3" "$4" "$5" >"$1"
}
for vehicle in quad-5in quad-7in; do
  # The nearest hover leaves the body's radius and 10 cm to the wall.
  near=$([[ $vehicle == quad-5in ]] && echo 0.27 || echo 0.33)
  for d in 4 2 1; do
    half=$(python3 -c "print(round($d / 2 - $near, 3))")
    rows=$([[ $d == 1 ]] && echo 3 || { [[ $d == 2 ]] && echo 5 || echo 7; })
    spec "$work/$vehicle-$d.toml" "[0, 0, 1.0]" "[0, -$half, 0.35]" "[0, $half, 2.2]" "[1, $rows, 5]"
    for ((f = 1; f <= 2 * flights; ++f)); do
      "$backwash" simulate --map "builtin:parallel-walls-${d}m" --vehicle "builtin:$vehicle" \
        --flight "$work/$vehicle-$d.toml" --seed $((1000 * d + f)) --out "$work/$vehicle-$d-$f.csv" --force >"$work/simulate.txt"
    done
  done
  # Scenes that are not fitted.
  spec "$work/$vehicle-apartment.toml" "[3.0, 4.0, 1.2]" "[2.4, 3.6, 0.5]" "[5.2, 4.6, 2.0]" "[4, 2, 4]"
  spec "$work/$vehicle-narrow-gap.toml" "[3.05, 0, 1.2]" "[3.05, -0.1, 0.5]" "[3.05, 0.1, 2.0]" "[1, 2, 6]"
  spec "$work/$vehicle-forest-1.toml" "[-19, 0, 1.2]" "[-19.3, -0.3, 0.5]" "[-18.7, 0.3, 2.0]" "[2, 2, 4]"
  for scene in apartment narrow-gap forest-1; do
    for ((f = 1; f <= flights; ++f)); do
      "$backwash" simulate --map "builtin:$scene" --vehicle "builtin:$vehicle" --flight "$work/$vehicle-$scene.toml" \
        --seed $((9000 + f)) --out "$work/$vehicle-$scene-$f.csv" --force >"$work/simulate.txt"
    done
  done
  for q in 0.80 0.90 0.95; do
    arguments=()
    for d in 4 2 1; do
      arguments+=(--map "builtin:parallel-walls-${d}m" --log)
      for ((f = 1; f <= flights; ++f)); do arguments+=("$work/$vehicle-$d-$f.csv"); done
    done
    "$backwash" calibrate "${arguments[@]}" --vehicle "builtin:$vehicle" --base-model "builtin:$vehicle" --quantile $q \
      --out "$work/$vehicle-$q.toml" --report "$work/$vehicle-$q.html" --force --json >"$work/$vehicle-$q.json"
    # The other half of the flights, and the other scenes: judged with the model just written, not fitted.
    for place in parallel-walls-4m parallel-walls-2m parallel-walls-1m apartment narrow-gap forest-1; do
      logs=()
      if [[ $place == parallel-walls-* ]]; then
        d=${place#parallel-walls-}
        for ((f = flights + 1; f <= 2 * flights; ++f)); do logs+=("$work/$vehicle-${d%m}-$f.csv"); done
      else
        for ((f = 1; f <= flights; ++f)); do logs+=("$work/$vehicle-$place-$f.csv"); done
      fi
      "$backwash" calibrate --judge --map "builtin:$place" --log "${logs[@]}" --vehicle "builtin:$vehicle" \
        --base-model "$work/$vehicle-$q.toml" --quantile $q --json >"$work/$vehicle-$q-$place.json"
    done
  done
done
python3 "$here/calibrate_table.py" "$work"
