#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The study against worlds with hidden effects: the confusion matrix of core/study/discrepancy/README.md.
# usage: study.sh STUDY_MATRIX [WORLDS per cell] [SEED]   (STUDY_MATRIX: build/…/tests/study_worlds/study_matrix)
set -euo pipefail
matrix=${1:?usage: study.sh STUDY_MATRIX [WORLDS] [SEED]}
exec "$matrix" --worlds "${2:-200}" --seed "${3:-${BACKWASH_STUDY_SEED:-$(date +%s)}}" --sizes 1
