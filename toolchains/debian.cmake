# SPDX-License-Identifier: BSD-3-Clause
# Included by the toolchain of each Debian architecture, which sets BACKWASH_TRIPLET and CMAKE_SYSTEM_PROCESSOR. The sysroot is
# BACKWASH_SYSROOT, as build.sh makes it of Debian's own packages.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES BACKWASH_SYSROOT)
if(NOT EXISTS "${BACKWASH_SYSROOT}/usr/lib/${BACKWASH_TRIPLET}")
  message(FATAL_ERROR "BACKWASH_SYSROOT=\"${BACKWASH_SYSROOT}\" is no sysroot of ${BACKWASH_TRIPLET}: toolchains/build.sh makes one")
endif()
set(CMAKE_SYSROOT "${BACKWASH_SYSROOT}")
set(CMAKE_C_COMPILER ${BACKWASH_TRIPLET}-gcc)
set(CMAKE_CXX_COMPILER ${BACKWASH_TRIPLET}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${BACKWASH_TRIPLET})
# Libraries, headers and CMake packages of the sysroot; programs (idlc, python3) of this machine.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${BACKWASH_SYSROOT}")
set(ENV{PKG_CONFIG_LIBDIR}
    "${BACKWASH_SYSROOT}/usr/lib/${BACKWASH_TRIPLET}/pkgconfig:${BACKWASH_SYSROOT}/usr/share/pkgconfig")
# Libraries that libraries need, BLAS behind update-alternatives among them.
set(CMAKE_EXE_LINKER_FLAGS_INIT
    "-Wl,-rpath-link,${BACKWASH_SYSROOT}/usr/lib/${BACKWASH_TRIPLET} -Wl,-rpath-link,${BACKWASH_SYSROOT}/lib/${BACKWASH_TRIPLET}")
# Whatever the build runs of its own (man pages, names of tests) and ctest's tests.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-${BACKWASH_QEMU}-static -L "${BACKWASH_SYSROOT}")
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE ${BACKWASH_DEBIAN})
# dpkg-shlibdeps finds libraries in the sysroot. Debian's folder of libraries, which CMake takes on Debian itself alone.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${BACKWASH_SYSROOT}/usr/lib/${BACKWASH_TRIPLET};${BACKWASH_SYSROOT}/lib/${BACKWASH_TRIPLET};${BACKWASH_SYSROOT}/lib")
set(CMAKE_INSTALL_LIBDIR "lib/${BACKWASH_TRIPLET}" CACHE PATH "as dpkg-architecture names it")
