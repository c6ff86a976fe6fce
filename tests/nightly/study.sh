#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The study against worlds with hidden effects: the tables of docs/measurements/confusion.md. The matrix is a campaign in the folder
# FILE-campaign: what was cut goes on with the next call of the same SEED and FILE. Exit 1: a gate is missed.
# usage: study.sh STUDY_MATRIX [WORLDS per cell] [SEED] [FILE]   (STUDY_MATRIX: build/…/tests/study_worlds/study_matrix)
set -euo pipefail
matrix=$(realpath "${1:?usage: study.sh STUDY_MATRIX [WORLDS] [SEED] [FILE]}")
backwash=$(dirname "$matrix")/../../services/backwash
worlds=${2:-200}
seed=${3:-${BACKWASH_STUDY_SEED:-$(date +%s)}}
file=${4:-study-$seed}
"$matrix" --null-size --worlds "$worlds" --seed "$seed" --jobs "$(nproc)" >"$file-null.md"
for ((k = 0; k < worlds; ++k)); do
  printf '%q ' "$matrix" --rows --worlds 1 --seed $((seed + k))
  echo
done >"$file.txt"
seq "$worlds" | xargs -P "$(nproc)" -n 1 "$backwash" campaign run "$file.txt" -o "$file-campaign"
"$backwash" campaign merge "$file.txt" -o "$file-campaign"
exec "$matrix" --from "$file-campaign/rows.jsonl" --markdown "$file.md" --gate
