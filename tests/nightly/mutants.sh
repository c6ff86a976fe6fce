#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Would a test notice? Plants each defect of tests/mutants one at a time; arguments go to `mutants.py run`.
# Exit 1: a score below 0.97.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source ./setup.sh
install_packages packages.txt
tests/mutants/mutants.py build
exec tests/mutants/mutants.py run "$@"
