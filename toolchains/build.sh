#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds for another processor, and runs the tests of core and bridge there under qemu-user.
#   toolchains/build.sh aarch64|armhf [TARGET …]     sysroot, configuration, build (default: every program)
#   toolchains/build.sh aarch64|armhf --test [PART …]   tests of core and firmware_bridge under qemu-user (default: all of them)
#   toolchains/build.sh aarch64|armhf --package      the Debian packages, in build/ARCH/packages
#   toolchains/build.sh cortex-m                     firmware_bridge/plain for Cortex-M0, M4 and M7
# Sysroots and builds are in build/sysroot-ARCH and build/ARCH. What is missing is installed as by ./check.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source ./setup.sh
arch=${1:-}
shift || true

if [[ $arch == cortex-m ]]; then
  install_packages toolchains/packages.cortex-m.txt
  for core in cortex-m0 cortex-m4 cortex-m7; do
    cmake -S toolchains/cortex-m -B "build/$core" -G Ninja --toolchain "$PWD/toolchains/cortex-m.cmake" -DBACKWASH_CORE=$core \
      -DCMAKE_BUILD_TYPE=MinSizeRel >/dev/null
    cmake --build "build/$core" >/dev/null
    arm-none-eabi-size "build/$core/libbackwash_plain.a" | awk -v core=$core 'NR == 2 { print core ": " $1 " bytes of code, " $2 + $3 " of data" }'
  done
  exit
fi
case $arch in
  aarch64) debian=arm64 qemu=aarch64 compiler=aarch64-linux-gnu-gcc ;;
  armhf) debian=armhf qemu=arm compiler=arm-linux-gnueabihf-gcc ;;
  *) sed -n '3,9s/^# \{0,1\}//p' "$0" >&2; exit 64 ;;
esac
install_packages toolchains/packages.$arch.txt

# The headers and libraries of packages.txt, and of the tests of core and bridge, for that architecture. Co-installation fails:
# files of octomap's CMake package collide.
sysroot=$PWD/build/sysroot-$arch
wanted=$(sed 's/#.*//' packages.txt | grep -E -- '-dev *$' | xargs | tr ' ' ','),libgtest-dev,libgmock-dev,libfastrtps-dev
# fetched [ARCHIVE …]: default, those of this machine's Debian.
fetched() {
  rm -rf "$sysroot"
  mmdebstrap --quiet --variant=extract --architectures=$debian --include="libc6-dev,libstdc++-12-dev,$wanted" \
    --extract-hook="'$PWD/toolchains/database.sh' \"\$1\" $debian" bookworm "$sysroot" "$@" >build/sysroot-$arch.log 2>&1
}
make_sysroot() {
  local link to library from
  mkdir -p build
  if ! fetched; then
    # Security's list of a seldom used architecture may lag behind its signature for days.
    fetched "deb http://deb.debian.org/debian bookworm main" ||
      { tail -n 20 build/sysroot-$arch.log >&2; echo "build: no sysroot: build/sysroot-$arch.log" >&2; exit 70; }
    echo "build: the sysroot is of bookworm alone, without security's and other updates: their lists could not be fetched" >&2
  fi
  rm -rf "$sysroot"/{dev,tmp} # qemu-user would take these for ours
  # Nothing was configured in there: links into the root are made to stay, and the alternatives of BLAS and LAPACK chosen.
  find "$sysroot" -type l -lname '/*' -printf '%p\t%l\n' | while IFS=$'\t' read -r link to; do ln -sfn "$sysroot$to" "$link"; done
  for library in blas lapack; do
    from=$(find "$sysroot/usr/lib" -path "*/$library/lib$library.so.3" | head -n 1)
    [[ -z $from ]] || ln -sf "$from" "$(dirname "$(dirname "$from")")/lib$library.so.3"
  done
  # Some CMake packages (assimp, draco, Fast DDS) name libraries by absolute paths.
  find "$sysroot/usr/lib" -path '*/cmake/*.cmake' -exec sed -i -E "s#([\":;])(/usr/lib/[^/\";:>]+/lib)#\1$sysroot\2#g" {} +
  touch "$sysroot/.whole"
}
[[ -e $sysroot/.whole ]] || make_sysroot

cmake --preset release -B "build/$arch" --toolchain "$PWD/toolchains/$arch.cmake" -DBACKWASH_SYSROOT="$sysroot" >"build/$arch.log" 2>&1 ||
  { tail -n 20 "build/$arch.log" >&2; exit 70; }
"$compiler" --sysroot="$sysroot" -O2 -shared -fPIC -o "build/$arch/qemu_gaps.so" toolchains/qemu_gaps.c
# build TARGET …
build() {
  NINJA_STATUS='[%f/%t] ' cmake --build "build/$arch" --target "$@" 2>&1 | tee -a "build/$arch.log" | show "building for $arch"
}
# left_out PART: tests that take more than a second here, and up to some hundred times that under qemu-user; one that asks the
# terminal for what qemu 7.2 does not pass on (TIOCGEXCL).
left_out() {
  case $1 in
    reach) echo 'BoundCode.NoneOfABuilding*:SupportRecursion.ContainsRandomRollouts*:SupportRecursion.IsReachedByTheWorst*:HoverMap.Says*:ChanceTube.Is*Left*' ;;
    plan) echo 'World.OfABuildingUpdated*:RefusedAtOnce.SaysOfAnyGoal*:MemoryOfAWorld.*OfABuilding*:Search.DoesNotExplode*' ;;
    bridge) echo 'SerialPort.IsOursAlone' ;;
  esac
}
case ${1:-} in
  --test)
    parts=("${@:2}")
    [[ ${#parts[@]} -gt 0 ]] || parts=(sync files map field reach plan track log config bridge)
    build "${parts[@]/#/test_}"
    failed=()
    for part in "${parts[@]}"; do
      echo "test_$part for $arch"
      attended "qemu-${qemu}-static" -L "$sysroot" -E "LD_PRELOAD=$PWD/build/$arch/qemu_gaps.so" \
        "build/$arch/tests/test_$part" --gtest_brief=1 --gtest_filter="-$(left_out "$part")" || failed+=("$part")
    done
    [[ ${#failed[@]} -eq 0 ]] || { echo "build: failed: ${failed[*]}" >&2; exit 1; }
    ;;
  --package)
    build backwash backwashctl backwashd bench package_documents
    rm -rf "build/$arch/packages"
    # dpkg-shlibdeps asks what the sysroot's packages say.
    DEB_HOST_ARCH=$debian DPKG_ADMINDIR=$sysroot/var/lib/dpkg SOURCE_DATE_EPOCH=$(git log -1 --format=%ct) \
      attended cpack --config "build/$arch/CPackConfig.cmake" -B "build/$arch/packages" >>"build/$arch.log" 2>&1 ||
      { tail -n 20 "build/$arch.log" >&2; exit 70; }
    rm -rf "build/$arch/packages/_CPack_Packages"
    ls "build/$arch/packages"/*.deb
    ;;
  *) build "${@:-all}" ;;
esac
