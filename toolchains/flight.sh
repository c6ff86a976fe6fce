#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# A flight of another processor's daemon, under qemu-user, with this machine's bench; its raw log replayed by both.
#   toolchains/flight.sh NATIVE_BUILD ARCH OUT_DIR [MAP START GOAL]   after `toolchains/build.sh ARCH backwash backwashd`
# NATIVE_BUILD: build/release, built. Default: through the apartment's doorway. In a network of its own.
set -euo pipefail
[[ $# -eq 3 || $# -eq 6 ]] || { sed -n '4,5s/^# \{0,1\}//p' "$0" >&2; exit 64; }
mkdir -p "$3"
native=$(cd "$1" && pwd) arch=$2 out=$(cd "$3" && pwd)
map=${4:-builtin:apartment} start=${5:-3.0,4.2,1.2} goal=${6:-7.4,3.0,1.2}
cd "$(dirname "${BASH_SOURCE[0]}")/.."
build=$PWD/build/$arch
case $arch in
  aarch64) emulator=qemu-aarch64-static ;;
  armhf) emulator=qemu-arm-static ;;
  *) echo "flight: $arch: aarch64 or armhf" >&2; exit 64 ;;
esac
emulated=("$emulator" -L "$PWD/build/sysroot-$arch" -E "LD_PRELOAD=$build/qemu_gaps.so")
printf '#!/bin/sh\nexec %s "$@"\n' "${emulated[*]@Q} '$build/services/backwashd'" >"$out/backwashd"
chmod +x "$out/backwashd"

as_root=()
[[ $(id -u) -eq 0 ]] || as_root=(--map-root-user)
BACKWASHD=$out/backwashd unshare "${as_root[@]}" --net bash -c 'ip link set lo up multicast on && ip route add 224.0.0.0/4 dev lo &&
  exec services/bench/flight.sh "$@"' flight "$native" "$out" "$arch" "$map" "$start" "$goal"

replayed() { "$@" replay --log "$out/$arch.bwlog" --json --quiet; }
here=$(replayed "$native/services/backwash") there=$(replayed "${emulated[@]}" "$build/services/backwash")
echo "replayed here        $here"
[[ $here == "$there" ]] || { echo "replayed there       $there" >&2; exit 1; }
