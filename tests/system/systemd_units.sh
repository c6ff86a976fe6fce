#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Both units are good units (systemd-analyze verify, unknown keys are errors), as closed as systemd can tell (security
# --offline, at most 1.6 of 10), and keep what the daemon's safety needs of them.
#   systemd_units.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
die() { echo "$*" >&2; exit 1; }
root=$work/root
mkdir -p "$root"/usr/{bin,lib/systemd}
ln -s usr/lib "$root/lib"
cp -r /usr/lib/systemd/system "$root/usr/lib/systemd/"
printf '#!/bin/sh\n' >"$root/usr/bin/backwashd" # what is verified is the unit
chmod +x "$root/usr/bin/backwashd"
verify() { systemd-analyze verify --man=no --recursive-errors=yes --root="$root" "$1" 2>&1; }
install() { cp "$build/systemd/$1" "$root/usr/lib/systemd/system/"; }

for unit in backwashd.service backwashd@.service; do
  install "$unit"
  name=${unit/@./@left.}
  verify "$name" || die "$unit: see above"
  systemd-analyze security --offline=yes --no-pager --threshold=16 "$build/systemd/$unit" >"$work/security" ||
    die "$unit: $(tail -n 1 "$work/security")"
  echo "$unit: exposure $(sed -n 's/^.*Overall.*: \([0-9.]*\) .*/\1/p' "$work/security")"
  for needed in Type=notify WatchdogSec=3s WatchdogSignal=SIGKILL Restart=on-failure 'RestartPreventExitStatus=64 66 78' LimitCORE=0 \
    User=backwash DevicePolicy=closed MemorySwapMax=0; do
    grep -qxF "$needed" "$build/systemd/$unit" || die "$unit: no $needed"
  done
  ! grep -q '@[A-Z_]*@' "$build/systemd/$unit" || die "$unit: a placeholder is left"
done
# It can fail: a key that systemd does not know, and a unit without its closing.
sed -i 's/^WatchdogSec=/WatchdogSecs=/' "$root/usr/lib/systemd/system/backwashd.service"
! verify backwashd.service >"$work/said" || die "an unknown key was taken"
grep -q WatchdogSecs "$work/said" || die "said: $(<"$work/said")"
printf '[Service]\nExecStart=/usr/bin/backwashd\n' >"$work/open.service"
! systemd-analyze security --offline=yes --no-pager --threshold=16 "$work/open.service" >/dev/null || die "an open unit was taken"

for file in sysusers.conf tmpfiles.conf; do
  tool=systemd-${file%.conf}
  mkdir -p "$root/etc"
  [[ $file == sysusers.conf ]] || { "systemd-sysusers" --root="$root" "$source_dir/systemd/sysusers.conf" >/dev/null; }
  "$tool" --root="$root" $([[ $tool == *tmpfiles ]] && echo --create) "$source_dir/systemd/$file" >"$work/said" 2>&1 || die "$file: $(<"$work/said")"
done
grep -q '^backwash:.*:/usr/sbin/nologin$' "$root/etc/passwd" || die "the user has a shell: $(grep backwash "$root/etc/passwd")"
[[ $(stat -c %a "$root/var/lib/backwash") == 750 ]] || die "/var/lib/backwash is open"
