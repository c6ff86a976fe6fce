#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Holds another architecture's Debian packages against this one's, and installs them where nothing else is.
#   toolchains/packages.sh NATIVE_BUILD ARCH     after `toolchains/build.sh ARCH --package`; NATIVE_BUILD: build/release, built
# Exit code 1 unless the architecture is named, files have the same names but for the triplet, dependencies are the same
# packages, and the programs run under qemu-user on what Debian installs for these dependencies.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -eq 2 && -d $1 ]] || { sed -n '4s/^# \{0,1\}//p' "$0" >&2; exit 64; }
build=$(cd "$1" && pwd) arch=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
source "$source_dir/tests/system/packages.sh"
case $arch in
  aarch64) debian=arm64 qemu=aarch64 triplet=aarch64-linux-gnu ;;
  armhf) debian=armhf qemu=arm triplet=arm-linux-gnueabihf ;;
  *) die "$arch: aarch64 or armhf" ;;
esac
native=$(dpkg --print-architecture) native_triplet=$(gcc -dumpmachine)
others=$source_dir/build/$arch/packages

# files DEB TRIPLET: what it installs, with TRIPLET for the folder of libraries, sorted.
files() { dpkg-deb --fsys-tarfile "$1" | tar -t | sed "s#/$2/#/TRIPLET/#" | sort; }
make_packages "$work/native"
for package in backwash backwash-dev backwash-bench; do
  ours=$(echo "$work/native/$package"_*"_$native.deb") theirs=$(echo "$others/$package"_*"_$debian.deb")
  [[ -e $theirs ]] || die "no $theirs"
  [[ $(dpkg-deb -f "$theirs" Architecture) == "$debian" ]] || die "$package: Architecture: $(dpkg-deb -f "$theirs" Architecture)"
  diff <(files "$ours" "$native_triplet") <(files "$theirs" "$triplet") || die "$package: other files"
  diff <(depends "$ours") <(depends "$theirs") || die "$package: depends on other packages"
  echo "$package: $(files "$theirs" "$triplet" | grep -vc '/$') files, $(depends "$theirs" | grep -c .) dependencies, the same as for $native"
done

# What apt takes for them, and nothing of the sysroot that they were linked with.
root=$work/root
mkdir "$work/archive"
cp "$others"/*.deb "$work/archive"
(cd "$work/archive" && dpkg-scanpackages --multiversion . >Packages 2>/dev/null)
mmdebstrap --quiet --variant=extract --architectures=$debian --include=backwash,backwash-bench \
  --aptopt='APT::Install-Recommends "false"' bookworm "$root" "deb [trusted=yes] copy:$work/archive ./" \
  'deb http://deb.debian.org/debian bookworm main' >"$work/mmdebstrap.log" 2>&1 ||
  { cat "$work/mmdebstrap.log" >&2; die "apt does not install them"; }
rm -rf "$root/dev" "$root/tmp"
for program in backwash backwashctl backwashd backwash-bench; do
  said=$("qemu-$qemu-static" -L "$root" "$root/usr/bin/$program" --version) || die "$program does not run"
  [[ $said == "$program "* ]] || die "$program says: $said"
done
"qemu-$qemu-static" -L "$root" "$root/usr/bin/backwashd" --check-config --config "$root/etc/backwash/backwashd.toml" | grep -q good ||
  die "the shipped configuration is not good"
echo "installed for $debian, run under qemu-user"
