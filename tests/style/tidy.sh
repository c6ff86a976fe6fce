#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (.clang-tidy) over the sources of core, firmware_bridge and services, or over the files named. The whole tree is read in
# the units that a build joins it to: the headers of eight files are read once.
#   tidy.sh [FILE …]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/packages.txt
install_packages tests/style/packages.txt
join=OFF checks=
[[ $# -gt 0 ]] || join=ON checks=-bugprone-suspicious-include  # a joined unit includes sources
cmake -S . -B build/tidy -G Ninja -DCMAKE_BUILD_TYPE=Release -DBACKWASH_JOIN=$join -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
attended cmake --build build/tidy --target backwash_idl >/dev/null
[[ $# -gt 0 ]] || mapfile -t files < <(python3 - <<'PYTHON'
import json, re
rooms = "core|firmware_bridge|services"
for unit in json.load(open("build/tidy/compile_commands.json")):
    if re.search(rf"/({rooms})/.*\.(cpp|cxx)$", unit["file"]) and "/tests/" not in unit["file"]:
        print(unit["file"])
PYTHON
)
printf '%s\0' "${@:-${files[@]}}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy -p build/tidy --quiet --checks="$checks"
