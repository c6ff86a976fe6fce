#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Every tracked C and C++ file is as clang-format 14 writes it (.clang-format). Other versions write some lines in another
# way: without version 14 nothing is judged. Mend by: git ls-files '*.cpp' '*.hpp' '*.c' '*.h' | xargs clang-format -i
#   format.sh SOURCE_DIR [--install]      --install: first installs it (tests/style/packages.txt)
set -euo pipefail
cd "$1"
if [[ ${2:-} == --install ]]; then
  source ./setup.sh
  install_packages tests/style/packages.txt
fi
for formatter in clang-format-14 clang-format; do
  if [[ $("$formatter" --version 2>/dev/null) == *"version 14."* ]]; then
    git ls-files -z '*.cpp' '*.hpp' '*.c' '*.h' | xargs -0 -n 40 -P "$(nproc)" "$formatter" --dry-run -Werror
    exit
  fi
done
echo "clang-format 14 is not there: ./check installs it (tests/packages.txt)" >&2
exit 1
