# SPDX-License-Identifier: BSD-3-Clause
# Sourced by tests of what is installed; needs $source_dir, $build and $work.

source "$source_dir/tests/support/skip.sh"
die() { echo "$*" >&2; exit 1; }

# make_packages OUT: the .debs of the build.
make_packages() {
  mkdir -p "$1"
  SOURCE_DATE_EPOCH=$(git -C "$source_dir" log -1 --format=%ct) cpack --config "$build/CPackConfig.cmake" -B "$1" >"$work/cpack.log" 2>&1 ||
    { cat "$work/cpack.log" >&2; die "cpack failed"; }
  rm -rf "$1/_CPack_Packages"
}

# depends DEB …: the packages that they need, but for themselves.
depends() {
  local deb
  for deb; do dpkg-deb -f "$deb" Depends; done | tr ',|' '\n\n' | sed 's/(.*//; s/ //g; /^backwash/d; /^$/d' | sort -u
}

# make_root ROOT PACKAGE …: a Debian 12 of its own with systemd and these packages. Kept in the build as an archive.
make_root() {
  local root=$1 packages kept
  shift
  packages=$(printf '%s\n' systemd systemd-sysv dbus udev procps "$@" | sort -u | paste -sd,)
  kept=$build/root-$(sha256sum <<<"$packages" | cut -c1-12).tar
  if [[ ! -e $kept ]]; then
    of_debian nice -n 5 mmdebstrap --quiet --variant=minbase --include="$packages" bookworm "$work/new.tar"
    rm -f "$build"/root-*.tar
    mv "$work/new.tar" "$kept"
  fi
  mkdir -p "$root"
  tar -C "$root" --numeric-owner -xf "$kept"
}

# in_root COMMAND …: in $root, with its own processes alone.
in_root() {
  env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin unshare --mount --pid --fork --mount-proc="$root/proc" chroot "$root" "$@"
}
