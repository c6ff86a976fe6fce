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
if [[ ! -f $file-campaign/manifest.json ]]; then
  {
    printf 'kind = "program"\nseconds = 50\n[program]\nname = "world"\nseed = %s\ncount = %s\n' "$seed" "$worlds"
    printf 'command = ["%s", "--rows", "--worlds", "1", "--seed", "{seed}"]\n' "$matrix"
  } >"$file.toml"
  "$backwash" campaign plan "$file.toml" -o "$file-campaign"
fi
"$backwash" campaign run "$file-campaign" --jobs "$(nproc)"
"$backwash" campaign merge "$file-campaign"
exec "$matrix" --from "$file-campaign/rows.jsonl" --markdown "$file.md" --gate
