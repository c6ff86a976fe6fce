#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The study against worlds with hidden effects: the tables of core/study/confusion.md. Every world is kept as a
# line of JSON as soon as it is done; a cut run is summarised with `study_matrix --from FILE`. Exit 1: a gate is missed.
# usage: study.sh STUDY_MATRIX [WORLDS per cell] [SEED] [FILE]   (STUDY_MATRIX: build/…/tests/study_worlds/study_matrix)
set -euo pipefail
matrix=${1:?usage: study.sh STUDY_MATRIX [WORLDS] [SEED] [FILE]}
worlds=${2:-200}
seed=${3:-${BACKWASH_STUDY_SEED:-$(date +%s)}}
file=${4:-study-$seed}
"$matrix" --null-size --worlds "$worlds" --seed "$seed" --jobs "$(nproc)" >"$file-null.md"
exec "$matrix" --worlds "$worlds" --seed "$seed" --jobs "$(nproc)" --out "$file.jsonl" --markdown "$file.md" --gate
