# SPDX-License-Identifier: BSD-3-Clause
# Sourced by tests of real processes, each called as SCRIPT SOURCE_DIR BUILD_DIR: the session of services/bench, with its clean end.
set -euo pipefail
source_dir=$1 build=$2
source "$source_dir/services/bench/session.sh"
