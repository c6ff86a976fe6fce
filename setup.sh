#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Shared by ./fly and ./check: installs the Debian packages that are missing (packages.txt) and builds a preset.
# Source it; it defines the functions and runs nothing.

# Installs what is missing of packages.txt. Takes well under a second when nothing is.
install_packages() {
  local wanted missing=() sudo=()
  wanted=$(sed 's/#.*//' "$1" | xargs)
  for package in $wanted; do
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  [[ ${#missing[@]} -eq 0 ]] && return
  echo "installing: ${missing[*]}" >&2
  if [[ $(id -u) -ne 0 ]]; then
    command -v sudo >/dev/null || { echo "setup: not root and no sudo: install as root: apt-get install ${missing[*]}" >&2; exit 77; }
    sudo=(sudo)
  fi
  "${sudo[@]}" apt-get update -qq >&2
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
}

# Configures and builds a preset; further arguments go to the build. Output appears only if it fails.
build_preset() {
  local preset=$1 log
  shift
  log=$(mktemp)
  build_with() { cmake --preset "$preset" "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=$1" && cmake --build --preset "$preset" "${@:2}"; }
  if ! build_with OFF "$@" >"$log" 2>&1; then
    # Where the compiler cannot load a precompiled header ("… cmake_pch.hxx.gch: had text segment at different address"),
    # it does without, in twice the time.
    if ! grep -q 'cmake_pch\.hxx\.gch: ' "$log" || ! build_with ON "$@" >"$log" 2>&1; then
      cat "$log" >&2
      rm -f "$log"
      echo "setup: the $preset build failed" >&2
      exit 70
    fi
  fi
  rm -f "$log"
}
