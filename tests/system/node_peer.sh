# SPDX-License-Identifier: BSD-3-Clause
# Sourced by tests that hold ours against libraries from npm's registry, under node: none of it is a part of the programs.
#   node_peer BUILD_DIR TEST FOLDER PACKAGE@VERSION …: $modules is BUILD_DIR/FOLDER with the packages, fetched once. Without node,
# npm or the registry the test is skipped, and says so.
node_peer() {
  local build=$1 test=$2 tool
  modules=$build/$3
  shift 3
  for tool in node npm; do command -v $tool >/dev/null || { echo "skipped: $test needs $tool"; exit 77; }; done
  local package missing=()
  for package in "$@"; do [[ -d $modules/node_modules/${package%@*} ]] || missing+=("$package"); done
  [[ ${#missing[@]} -eq 0 ]] && return
  mkdir -p "$modules"
  timeout 120 npm install --fetch-retries=1 --fetch-retry-maxtimeout=5000 --prefer-offline --no-audit --no-fund --no-save --ignore-scripts --loglevel=error --prefix "$modules" "$@" >/dev/null 2>&1 ||
    { rm -rf "$modules"; echo "skipped: $test needs the npm registry ($*)"; exit 77; }
}
