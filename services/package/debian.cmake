# SPDX-License-Identifier: BSD-3-Clause
# cpack --config build/release/CPackConfig.cmake: backwash, backwash-dev and backwash-bench as .deb.
# Equal bytes from equal sources: every time stamp is the commit's (tests/system/package.sh packs twice and compares).
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VENDOR backwash)
set(CPACK_PACKAGE_CONTACT "backwash maintainers <maintainers@backwash.invalid>")
set(CPACK_SET_DESTDIR ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL backwash dev bench)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE "https://doi.org/10.1109/ICRA48506.2021.9560730")
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)

set(CPACK_DEBIAN_BACKWASH_PACKAGE_NAME backwash)
set(CPACK_DEBIAN_BACKWASH_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_BACKWASH_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_BACKWASH_PACKAGE_RECOMMENDS "libjs-three")
set(CPACK_COMPONENT_BACKWASH_DESCRIPTION "quadrotor flight daemon that plans by reachable sets of its own wash
Daemon, ground station and offline tools: estimates the disturbance that a
quadrotor's rotor wash causes near floors, walls and corners from a voxel map,
and plans and flies trajectories whose clearance is the reachable set of the
control error. Odometry and maps over DDS, set-points over MAVLink.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME backwash-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4), libnlopt-cxx-dev, libtomlplusplus-dev, libexpected-dev, zlib1g-dev")
set(CPACK_COMPONENT_DEV_DESCRIPTION "fields, reachable sets and plans of backwash as a library
The core library as a CMake package, with its headers and an example that
plans a flight.")

set(CPACK_DEBIAN_BENCH_PACKAGE_NAME backwash-bench)
set(CPACK_DEBIAN_BENCH_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_BENCH_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_BENCH_PACKAGE_RECOMMENDS "backwash")
set(CPACK_COMPONENT_BENCH_DESCRIPTION "emulated flight controller, odometry and mapper for backwash
A bench for the flight daemon: an emulated flight controller on a
pseudo-terminal, odometry and maps over DDS, faults on demand.")

# Documents that Debian wants of each package, and what the daemon's package does at installation.
execute_process(COMMAND git log -1 --format=%ct WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE COMMIT_TIME
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT COMMIT_TIME)
  set(COMMIT_TIME 0)
endif()
execute_process(COMMAND date -u -R -d @${COMMIT_TIME} OUTPUT_VARIABLE COMMIT_DATE OUTPUT_STRIP_TRAILING_WHITESPACE)
foreach(component backwash dev bench)
  string(TOUPPER ${component} COMPONENT)
  set(PACKAGE ${CPACK_DEBIAN_${COMPONENT}_PACKAGE_NAME})
  set(folder ${PACKAGE_OUT}/debian/${PACKAGE})
  configure_file(debian/changelog.in ${folder}/changelog @ONLY)
  configure_file(debian/copyright.in ${folder}/copyright @ONLY)
  execute_process(COMMAND gzip -9nf ${folder}/changelog)
  install(FILES ${folder}/changelog.gz ${folder}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${PACKAGE} COMPONENT ${component})
endforeach()
set(conffiles "")
foreach(file ${VEHICLES} backwashd.toml)
  get_filename_component(name ${file} NAME)
  string(APPEND conffiles "/etc/backwash/${name}\n")
endforeach()
file(CONFIGURE OUTPUT ${PACKAGE_OUT}/debian/conffiles CONTENT "${conffiles}" @ONLY)
set(CPACK_DEBIAN_BACKWASH_PACKAGE_CONTROL_EXTRA ${PACKAGE_OUT}/debian/conffiles ${CMAKE_CURRENT_SOURCE_DIR}/debian/postinst
    ${CMAKE_CURRENT_SOURCE_DIR}/debian/prerm ${CMAKE_CURRENT_SOURCE_DIR}/debian/postrm)
include(CPack)
