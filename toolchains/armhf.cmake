# SPDX-License-Identifier: BSD-3-Clause
# 32-bit ARM with hardware floating point: Debian armhf (ARMv7 with VFPv3-D16).
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(BACKWASH_TRIPLET arm-linux-gnueabihf)
set(BACKWASH_QEMU arm)
set(BACKWASH_DEBIAN armhf)
include(${CMAKE_CURRENT_LIST_DIR}/debian.cmake)
