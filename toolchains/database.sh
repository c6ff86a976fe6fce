#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What dpkg would know of a sysroot's packages: of which package a library is, and what one that links with it depends on.
# mmdebstrap extracts packages of another architecture and configures none; dpkg-shlibdeps and sbom.py ask dpkg.
#   database.sh SYSROOT ARCHITECTURE      of the .debs that mmdebstrap has fetched: its --extract-hook
set -euo pipefail
sysroot=$1 architecture=$2
admin=$sysroot/var/lib/dpkg
mkdir -p "$admin/info"
echo 1 >"$admin/info/format"
printf '%s\n' "$(dpkg --print-architecture)" "$architecture" >"$admin/arch"
: >"$admin/status"
for deb in "$sysroot"/var/cache/apt/archives/*.deb; do
  { dpkg-deb -f "$deb"; printf 'Status: install ok installed\n\n'; } >>"$admin/status"
  name=$(dpkg-deb -f "$deb" Package)
  [[ $(dpkg-deb -f "$deb" Multi-Arch) != same ]] || name+=:$architecture
  # By the path that they have here.
  dpkg-deb --fsys-tarfile "$deb" | tar -t | sed -n "s#^\.\(/.*[^/]\)\$#$sysroot\1#p" >"$admin/info/$name.list"
  for part in symbols shlibs; do
    dpkg-deb -I "$deb" $part >"$admin/info/$name.$part" 2>/dev/null || rm "$admin/info/$name.$part"
  done
done
