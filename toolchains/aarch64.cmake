# SPDX-License-Identifier: BSD-3-Clause
# Raspberry Pi 4 and 5, Jetson: Debian arm64.
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(BACKWASH_TRIPLET aarch64-linux-gnu)
set(BACKWASH_QEMU aarch64)
set(BACKWASH_DEBIAN arm64)
include(${CMAKE_CURRENT_LIST_DIR}/debian.cmake)
