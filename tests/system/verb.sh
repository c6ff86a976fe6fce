# SPDX-License-Identifier: BSD-3-Clause
# For scripts that try one verb, which source this first with their own arguments: $backwash, the scripts' folder $here, an
# empty folder to work in, and die.
set -euo pipefail
backwash=${1:?usage: $(basename "$0") BACKWASH}
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
die() { echo "$*"; exit 1; }
