#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# clang-tidy (.clang-tidy) over the sources of core, firmware_bridge and services, or over the files named. Configures and
# builds first: the headers made from idl have to be there. The whole tree takes hours on two processors.
#   tidy.sh [FILE …]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source ./setup.sh
install_packages packages.txt
install_packages tests/style/packages.txt
build_preset release
[[ $# -gt 0 ]] || mapfile -t files < <(git ls-files 'core/*.cpp' 'firmware_bridge/*.cpp' 'services/*.cpp')
# The headers that gcc compiled beforehand mean nothing to clang: without them each file is read by itself.
mkdir -p build/tidy
sed -E 's/-Winvalid-pch //g; s/-include [^ ]*cmake_pch\.hxx //g' build/release/compile_commands.json >build/tidy/compile_commands.json
printf '%s\0' "${@:-${files[@]}}" | xargs -0 -n 1 -P "$(nproc)" clang-tidy -p build/tidy --quiet
