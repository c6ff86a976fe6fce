#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (.clang-tidy) over the sources of core, firmware_bridge and services, or over the files named. Configures first,
# each file by itself, and makes the headers of idl. The whole tree takes hours on two processors.
#   tidy.sh [FILE …]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/style/packages.txt
cmake -S . -B build/tidy -G Ninja -DCMAKE_BUILD_TYPE=Release -DBACKWASH_JOIN=OFF -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON >/dev/null
attended cmake --build build/tidy --target backwash_idl >/dev/null
[[ $# -gt 0 ]] || mapfile -t files < <(git ls-files 'core/*.cpp' 'firmware_bridge/*.cpp' 'services/*.cpp')
printf '%s\0' "${@:-${files[@]}}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy -p build/tidy --quiet
