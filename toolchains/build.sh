#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds for another processor, and runs the tests of core and bridge there under qemu-user.
#   toolchains/build.sh aarch64|armhf [TARGET …]     sysroot, configuration, build (default: every program)
#   toolchains/build.sh aarch64|armhf --test         tests of core and firmware_bridge under qemu-user
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
  aarch64) debian=arm64 qemu=aarch64 ;;
  armhf) debian=armhf qemu=arm ;;
  *) sed -n '3,8s/^# \{0,1\}//p' "$0" >&2; exit 64 ;;
esac
install_packages toolchains/packages.$arch.txt

# The headers and libraries of packages.txt for that architecture. Co-installation fails: files of octomap's CMake package collide.
sysroot=$PWD/build/sysroot-$arch
if [[ ! -e $sysroot/.whole ]]; then
  rm -rf "$sysroot"
  wanted=$(sed 's/#.*//' packages.txt | grep -E -- '-dev *$' | xargs | tr ' ' ',')
  mkdir -p build
  mmdebstrap --quiet --variant=extract --architectures=$debian --include="libc6-dev,libstdc++-12-dev,$wanted" \
    bookworm "$sysroot" >build/sysroot-$arch.log 2>&1 ||
    { tail -n 20 build/sysroot-$arch.log >&2; echo "build: no sysroot: build/sysroot-$arch.log" >&2; exit 70; }
  # Nothing was configured in there: links into the root are made to stay, and the alternatives of BLAS and LAPACK chosen.
  find "$sysroot" -type l -lname '/*' -printf '%p\t%l\n' | while IFS=$'\t' read -r link to; do ln -sfn "$sysroot$to" "$link"; done
  for library in blas lapack; do
    from=$(find "$sysroot/usr/lib" -path "*/$library/lib$library.so.3" | head -n 1)
    [[ -z $from ]] || ln -sf "$from" "$(dirname "$(dirname "$from")")/lib$library.so.3"
  done
  # Some CMake packages (assimp, draco, Fast DDS) name libraries by absolute paths.
  find "$sysroot/usr/lib" -path '*/cmake/*.cmake' -exec sed -i -E "s#([\":;])(/usr/lib/[^/\";:>]+/lib)#\1$sysroot\2#g" {} +
  touch "$sysroot/.whole"
fi

cmake --preset release -B "build/$arch" --toolchain "$PWD/toolchains/$arch.cmake" -DBACKWASH_SYSROOT="$sysroot" >"build/$arch.log" 2>&1 ||
  { tail -n 20 "build/$arch.log" >&2; exit 70; }
tests=(test_sync test_files test_map test_field test_reach test_plan test_track test_log test_config test_bridge)
if [[ ${1:-} == --test ]]; then
  NINJA_STATUS='[%f/%t] ' cmake --build "build/$arch" --target "${tests[@]}" 2>&1 | tee -a "build/$arch.log" | show "building for $arch"
  for test in "${tests[@]}"; do
    echo "$test for $arch"
    attended "qemu-${qemu}-static" -L "$sysroot" "build/$arch/tests/$test" --gtest_brief=1
  done
  exit
fi
NINJA_STATUS='[%f/%t] ' cmake --build "build/$arch" --target "${@:-all}" 2>&1 | tee -a "build/$arch.log" | show "building for $arch"
