#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The Debian packages, in a root of their own: installed they run, an upgrade keeps what a person changed and leaves a daemon
# that runs alone, purging leaves raw logs and nothing else; lintian finds no error; packed twice they are equal byte for byte;
# `cmake --install` puts the same files; a project outside the tree plans a flight with the library.
#   package.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
source "$source_dir/tests/system/packages.sh"
needs cpack dpkg-shlibdeps file lintian mmdebstrap
needs_root

make_packages "$work/debs"
sleep 1
make_packages "$work/again"
[[ $(ls "$work/debs" | wc -l) -eq 3 ]] || die "packages: $(ls "$work/debs")"
for deb in "$work"/debs/*.deb; do cmp "$deb" "$work/again/${deb##*/}" || die "${deb##*/} differs when packed again"; done

# The files of `cmake --install` are the packages', but for Debian's own documents.
for component in backwash dev bench; do
  DESTDIR=$work/installed cmake --install "$build" --component $component >/dev/null
done
for deb in "$work"/debs/*.deb; do dpkg-deb -x "$deb" "$work/unpacked"; done
diff <(cd "$work/installed" && find . ! -type d | sort) <(cd "$work/unpacked" && find . ! -type d | sort) || die "cmake --install puts other files"

# A project of its own, with the installed library alone.
cp -r "$work/unpacked/usr/share/doc/backwash-dev/example" "$work/example"
cmake -S "$work/example" -B "$work/example/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/unpacked/usr" >"$work/example.log" 2>&1 &&
  cmake --build "$work/example/build" >>"$work/example.log" 2>&1 || { cat "$work/example.log" >&2; die "the example does not build"; }
said=$("$work/example/build/plan_a_flight")
[[ $said =~ ^[345]\.[0-9]+\ m\ in\ .*beyond\ the\ reachable\ sets\ 0\.[0-9]+\ m ]] || die "the example says: $said"
echo "example: $said"

lintian --allow-root --fail-on error --tag-display-limit 0 "$work"/debs/*.deb >"$work/lintian" 2>&1 ||
  { cat "$work/lintian" >&2; die "lintian has errors"; }
echo "lintian: no error, $(grep -c '^W:' "$work/lintian" || true) warnings"

root=$work/root
make_root "$root" $(depends "$work"/debs/backwash_*.deb "$work"/debs/backwash-bench_*.deb)
cp "$work"/debs/backwash_*.deb "$root/tmp/new.deb"
cp "$work"/debs/backwash-bench_*.deb "$root/tmp/bench.deb"
mkdir "$work/old"
dpkg-deb -R "$root/tmp/new.deb" "$work/old" # an earlier version, whose vehicle file was another
sed -i 's/^Version: .*/Version: 0.0.1/' "$work/old/DEBIAN/control"
echo '# earlier' >>"$work/old/etc/backwash/quad-7in.vehicle.toml"
dpkg-deb -b "$work/old" "$root/tmp/old.deb" >/dev/null
quiet() { "$@" >"$work/said" 2>&1 || { cat "$work/said" >&2; die "$* failed"; }; }

quiet in_root dpkg -i /tmp/old.deb /tmp/bench.deb
in_root backwashd --check-config --config /etc/backwash/backwashd.toml | grep -q good || die "the shipped configuration is not good"
for program in backwash backwashctl backwashd backwash-bench; do
  in_root $program --version | grep -q "^$program " || die "$program does not run"
done
in_root backwash vehicle --help >/dev/null
[[ $(in_root stat -c '%U %a' /var/lib/backwash) == 'backwash 750' ]] || die "/var/lib/backwash: $(in_root stat -c '%U %a' /var/lib/backwash)"
in_root bash -c 'source /usr/share/bash-completion/completions/backwash &&
  COMP_WORDS=(backwash pl) COMP_CWORD=1 && _backwash && [[ ${COMPREPLY[*]} == plan ]] &&
  COMP_WORDS=(backwash plan --vm) COMP_CWORD=2 && _backwash && [[ ${COMPREPLY[*]} == --vmax ]] &&
  COMP_WORDS=(backwash map co) COMP_CWORD=2 && _backwash && [[ ${COMPREPLY[*]} == convert ]] &&
  COMP_WORDS=(backwash map convert --points) COMP_CWORD=3 && _backwash && [[ ${COMPREPLY[*]} == --points-least ]]' || die "the completion completes nothing"
[[ ! -e $root/etc/systemd/system/multi-user.target.wants/backwashd.service ]] || die "installing enabled the daemon"

echo '# mine' >>"$root/etc/backwash/backwashd.toml"
echo 'a flight' >"$root/var/lib/backwash/flight.bwlog"
quiet in_root dpkg --force-confdef --force-confold -i /tmp/new.deb
grep -q '^# mine' "$root/etc/backwash/backwashd.toml" || die "an upgrade took back what a person changed"
! grep -q '^# earlier' "$root/etc/backwash/quad-7in.vehicle.toml" || die "an upgrade left an unchanged file of the earlier version"
cmp "$root/var/lib/backwash/flight.bwlog" <(echo 'a flight') || die "an upgrade touched a raw log"

quiet in_root dpkg -P backwash-bench backwash
left=$(cd "$root" && find . -xdev -name '*backwash*' ! -path './var/lib/dpkg/*' ! -path './var/log/*' ! -path './tmp/*' | sort | paste -sd' ')
[[ $left == './var/lib/backwash' && -e $root/var/lib/backwash/flight.bwlog ]] || die "after the purge: $left"
echo "installed, upgraded, purged"
