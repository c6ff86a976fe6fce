# SPDX-License-Identifier: BSD-3-Clause
# The controller's side of the plain link (firmware_bridge/plain) on a microcontroller: Debian's gcc-arm-none-eabi, no library.
# BACKWASH_CORE: cortex-m0, cortex-m4 (default) or cortex-m7.
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BACKWASH_CORE)
if(NOT BACKWASH_CORE)
  set(BACKWASH_CORE cortex-m4)
endif()
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY) # there is nothing to link a program with
set(CMAKE_C_FLAGS_INIT "-mcpu=${BACKWASH_CORE} -mthumb -ffreestanding -ffunction-sections")
