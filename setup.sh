#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Shared by ./fly and ./check: installs the Debian packages that are missing (packages.txt), builds a preset and shows how far
# that is; ends every child when it is interrupted. Source it; it defines the functions, sets the traps and runs nothing.

# descendants PID: every process below it.
descendants() {
  local stat fields pid child
  for stat in /proc/[0-9]*/stat; do
    { fields=$(<"$stat"); } 2>/dev/null || continue # it has ended meanwhile
    pid=${fields%% *}
    read -r _ child _ <<<"${fields##*) }"
    [[ $child == "$1" ]] || continue
    echo "$pid"
    descendants "$pid"
  done
}

# Ends every child: asked first, and killed 1.5 s later. A command in the background ignores Ctrl-C by itself.
end_children() {
  local pids pid
  pids=$(descendants $$)
  kill -TERM $pids 2>/dev/null || true
  for _ in $(seq 15); do
    sleep 0.1
    for pid in $pids; do kill -0 "$pid" 2>/dev/null && continue 2; done
    return 0
  done
  kill -KILL $pids 2>/dev/null || true
}
interrupted() {
  trap '' INT TERM HUP
  end_children
  echo "interrupted" >&2
  exit 130
}
trap interrupted INT TERM HUP

# attended COMMAND …: runs it so that a signal to this script is answered at once, not after the command.
attended() {
  "$@" &
  wait $!
}

# show STAGE: reads a build's output and says on one line of a terminal, or at each tenth of the way, what is done and how long
# the rest takes at the speed so far.
show() {
  local line done_ total left tenth=0 begun=$SECONDS
  while IFS= read -r line; do
    [[ $line =~ ^\[([0-9]+)/([0-9]+)\] ]] || continue
    done_=${BASH_REMATCH[1]} total=${BASH_REMATCH[2]}
    [[ $done_ -gt 0 ]] || continue
    left=$(((SECONDS - begun) * (total - done_) / done_))
    if [[ -t 2 ]]; then
      printf '\r%s: %d of %d, about %d min %02d s left \e[K' "$1" "$done_" "$total" $((left / 60)) $((left % 60)) >&2
    elif [[ $((done_ * 10 / total)) -gt $tenth ]]; then
      tenth=$((done_ * 10 / total))
      echo "$1: $done_ of $total, about $((left / 60)) min $((left % 60)) s left" >&2
    fi
  done
  [[ ! -t 2 ]] || printf '\r\e[K' >&2
}

# lacks WORDS: this machine cannot give what was to be installed; what needs it does not run, and says these words.
lacks() {
  echo "$*" >>build/lacking
  echo "setup: $*" >&2
  exit 77
}

# Installs what is missing of a list of packages; apt's own words go to build/apt.log. Takes well under a second when nothing is.
# A line command:NAME is a package that is not wanted where there is a command of that name.
install_packages() {
  local wanted package missing=() sudo=()
  wanted=$(sed 's/#.*//' "$1" | xargs)
  mkdir -p build
  for package in $wanted; do
    [[ $package != command:* ]] || { package=${package#*:}; command -v "$package" >/dev/null && continue; }
    [[ $(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null) == installed ]] || missing+=("$package")
  done
  [[ ${#missing[@]} -eq 0 ]] && return
  echo "installing ${#missing[@]} packages (build/apt.log): ${missing[*]}" >&2
  if [[ $(id -u) -ne 0 ]]; then
    command -v sudo >/dev/null || lacks "right: not root and no sudo: install as root: apt-get install ${missing[*]}"
    sudo=(sudo)
    sudo -v # asks for the password here, not in the log
  fi
  apt() { attended "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq "$@" >>build/apt.log 2>&1; }
  if ! apt update || ! apt install -y --no-install-recommends "${missing[@]}"; then
    tail -n 20 build/apt.log >&2
    apt update -o APT::Update::Error-Mode=any || lacks "network: Debian's mirrors: $(tail -n 1 build/apt.log)"
    echo "setup: apt-get failed: build/apt.log" >&2
    exit 70
  fi
}

# The libraries that tests hold ours against: tests/peers/package.json in build/peers.
install_peers() {
  cmp -s tests/peers/package.json build/peers/installed.json && return
  echo "installing tests/peers/package.json (build/npm.log)" >&2
  rm -rf build/peers
  mkdir -p build/peers
  cp tests/peers/package.json build/peers/
  if ! attended npm install --prefix build/peers --no-audit --no-fund --ignore-scripts >build/npm.log 2>&1; then
    tail -n 20 build/npm.log >&2
    npm ping >/dev/null 2>&1 || lacks "network: npm's registry: $(grep -m 1 '^npm error' build/npm.log)"
    echo "setup: npm failed: build/npm.log" >&2
    exit 70
  fi
  cp tests/peers/package.json build/peers/installed.json
}

# Configures and builds a preset; further arguments go to the build. Its output, build/PRESET.log, appears only if it fails.
build_preset() {
  local preset=$1 log=build/$1.log without
  shift
  mkdir -p build
  # Where the compiler cannot load a precompiled header ("… cmake_pch.hxx.gch: had text segment at different address"), it does
  # without, in twice the time.
  for without in OFF ON; do
    if attended build_with "$preset" "$without" "$@"; then return; fi
    grep -q 'cmake_pch\.hxx\.gch: ' "$log" || break
  done
  cat "$log" >&2
  echo "setup: the $preset build failed" >&2
  exit 70
}
build_with() {
  local preset=$1 without=$2 log=build/$1.log
  cmake --preset "$preset" "-DCMAKE_DISABLE_PRECOMPILE_HEADERS=$without" >"$log" 2>&1 || return
  NINJA_STATUS='[%f/%t] ' cmake --build --preset "$preset" "${@:3}" 2>&1 | tee -a "$log" | show "building"
}
