#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The daemon as it will be in the field: its package in a Debian 12 of its own, started by a real systemd in systemd-nspawn, as its
# own user, with every restriction of its unit. What is asked there: systemd_root_guest.sh.
#   systemd_root.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
source "$source_dir/tests/system/packages.sh"
needs systemd-nspawn mmdebstrap cpack dpkg-shlibdeps file
needs_root

make_packages "$work/debs"
root=$work/root
make_root "$root" $(depends "$work"/debs/backwash_*.deb "$work"/debs/backwash-bench_*.deb)
cp "$work"/debs/backwash_*.deb "$work"/debs/backwash-bench_*.deb "$root/tmp/"
in_root bash -c 'dpkg -i /tmp/*.deb' >"$work/dpkg.log" 2>&1 || { cat "$work/dpkg.log" >&2; die "dpkg failed"; }
mv "$root/tmp" "$root/tmp.of.dpkg" && mkdir -m 1777 "$root/tmp"

cp "$source_dir/tests/system/systemd_root_guest.sh" "$root/guest.sh"
cat >"$root/etc/systemd/system/guest.service" <<'UNIT'
[Unit]
Description=what is asked of the daemon here
After=multi-user.target
[Service]
Type=oneshot
ExecStart=/guest.sh
ExecStopPost=/bin/systemctl poweroff --force --no-block
StandardOutput=file:/told
StandardError=inherit
UNIT
# The emulated flight controller: its port is a pseudo-terminal of the daemon's user, as the udev rule gives a real one to it.
cat >"$root/etc/systemd/system/bench.service" <<'UNIT'
[Service]
User=backwash
RuntimeDirectory=bench
ExecStart=/usr/bin/backwash-bench --map ${MAP} --vehicle builtin:quad-5in --start ${START} --link /run/bench/autopilot
EnvironmentFile=/etc/bench
UNIT
mkdir -p "$root/etc/systemd/system/multi-user.target.wants"
ln -s ../guest.service "$root/etc/systemd/system/multi-user.target.wants/guest.service"
sed -i 's|/dev/backwash-fc|/run/bench/autopilot|' "$root/etc/backwash/backwashd.toml"

# A network of its own; nothing but loopback. A container's limits are ceilings for its units, a machine's are not.
echo '127.0.0.1 localhost' >"$root/etc/hosts"
nspawn() { timeout --kill-after=10 900 systemd-nspawn --quiet --directory="$root" --register=no --keep-unit --private-network "$@"; }
nspawn true >"$work/console" 2>&1 || skip right "to make a container: $(tail -n 1 "$work/console")"
nspawn --boot --capability=CAP_IPC_LOCK --rlimit=RLIMIT_MEMLOCK=infinity --rlimit=RLIMIT_RTPRIO=99 --rlimit=RLIMIT_NICE=40 \
  --link-journal=no </dev/null >"$work/console" 2>&1 || true
[[ -e $root/told ]] || { tail -n 30 "$work/console" >&2; die "its systemd does not boot"; }
grep '^systemd: ' "$root/told" || true
grep -q '^systemd: all seen' "$root/told" || { tail -n 60 "$root/told" >&2; die "systemd_root: see above"; }
# Who lacks CAP_SYS_RESOURCE has no real time to give to a container.
grep -q '^systemd: NOT seen' "$root/told" || exit 0
((0x$(awk '/^CapEff/ { print $2 }' /proc/self/status) >> 24 & 1)) && die "real time was not seen in the container"
skip right "CAP_SYS_RESOURCE: real time and locked memory were not seen in the container, all else was"
