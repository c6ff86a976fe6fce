#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# The daemon with its [gpio] lines on a real character device: Debian's kernel with its gpio-sim driver in a QEMU guest, and
# gpio_guest_init.sh as the guest's first process.
#   gpio_guest.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source_dir=$1 build=$2 cache=$2/gpio_guest
source "$source_dir/tests/support/skip.sh"
needs qemu-system-x86_64 make xz
[[ $(uname -m) == x86_64 ]] || skip device "an x86-64 processor: the guest runs this build"

# The kernel has no gpio-sim module: it is made of Debian's source package of the same kernel, in a folder of the build.
# The interrupts of that driver use a function that only a kernel with them built in exports: the usual one does as well.
prepare() {
  local image version series root=$cache/root deb
  of_debian apt-cache show linux-image-amd64
  image=$(apt-cache depends linux-image-amd64 | sed -n 's/.*Depends: \(linux-image-[0-9].*\)/\1/p')
  version=${image#linux-image-} series=$(cut -d. -f1,2 <<<"${image#linux-image-}")
  cd "$cache"
  of_debian apt-get download -qq "$image" "linux-headers-$version" "linux-headers-${version%-amd64}-common" \
    "linux-kbuild-$series" "linux-source-$series" busybox-static
  for deb in "$cache"/*.deb; do
    [[ $deb == */linux-source* ]] || dpkg-deb -x "$deb" "$root"
  done
  mkdir -p "$cache/module"
  dpkg-deb --fsys-tarfile "$cache"/linux-source-*.deb | tar xO "./usr/src/linux-source-$series.tar.xz" |
    tar xJ -C "$cache/module" --strip-components=3 --wildcards '*/drivers/gpio/gpio-sim.c' '*/drivers/gpio/gpiolib.h' '*/kernel/irq/irq_sim.c'
  sed -i 's/handle_simple_irq(irq_to_desc(\(.*\)));/generic_handle_irq(\1);/' "$cache/module/irq_sim.c"
  printf 'obj-m := gpio_guest.o\ngpio_guest-y := gpio-sim.o irq_sim.o\n' >"$cache/module/Makefile"
  sed -i "s|/usr/src|$root/usr/src|" "$root/usr/src/linux-headers-$version/Makefile"
  make -C "$root/usr/src/linux-headers-$version" M="$cache/module" modules >"$cache/module.log" 2>&1 || failed "$(<"$cache/module.log")"
  cp "$root/boot/vmlinuz-$version" "$cache/vmlinuz"
  cp "$root/lib/modules/$version/kernel/fs/configfs/configfs.ko" "$cache/module/gpio_guest.ko" "$root/bin/busybox" "$cache/"
  rm -f "$cache"/*.deb
  touch "$cache/ready"
}
if [[ ! -e $cache/ready ]]; then
  rm -rf "$cache"
  mkdir -p "$cache"
  (prepare)
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
guest=$work/guest
mkdir -p "$guest"/{bin,proc,sys,dev,config,tmp,etc}
cp "$cache"/{configfs.ko,gpio_guest.ko} "$guest/"
cp "$cache/busybox" "$guest/bin/"
cp "$source_dir/tests/system/gpio_guest_init.sh" "$guest/init"
echo '127.0.0.1 localhost' >"$guest/etc/hosts"
for program in backwashd backwashctl; do
  cp "$build/services/$program" "$guest/bin/"
  ldd "$build/services/$program" | grep -o '/[^ ]*' | while read -r library; do cp --parents -L -n "$library" "$guest/"; done
done
domain=3 device=/dev/autopilot more_tables='[gpio]
chip = "BENCH"
stop_switch = "STOP"
strobe = "WATCHDOG"
led = "STATUS"'
source "$source_dir/services/bench/configuration.sh"
write_configuration builtin:quad-5in /tmp/flight.bwlog
sed 's/^priority = .*/priority = 0/' "$work/backwashd.toml" >"$guest/etc/backwashd.toml"
(cd "$guest" && find . | "$cache/busybox" cpio -o -H newc 2>/dev/null | gzip -1 >"$work/initrd")
timeout 900 qemu-system-x86_64 -machine pc -accel tcg -smp 2 -m 1024 -nographic -no-reboot -nic none \
  -kernel "$cache/vmlinuz" -initrd "$work/initrd" -append 'console=ttyS0 quiet panic=-1' </dev/null | tr -d '\r' >"$work/console" || true
grep -a '^gpio: ' "$work/console" || true
grep -aq '^gpio: all seen' "$work/console" || { tail -n 60 "$work/console" >&2; echo "gpio_guest: see above" >&2; exit 1; }
