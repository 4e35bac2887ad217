# SPDX-License-Identifier: GPL-3.0-or-later
# The Debian packages vpsbake, the program, and libvps-dev, the libraries: run `cpack` in a build of the preset deb, or `make deb`.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME vpsbake)
set(CPACK_PACKAGE_VENDOR "The vpsbake authors")
set(CPACK_PACKAGE_CONTACT "The vpsbake authors <vpsbake@packages.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
# Permissions that lintian and dpkg expect, for any umask.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/debian_documents.cmake)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_VPSBAKE_PACKAGE_NAME vpsbake)
set(CPACK_DEBIAN_VPSBAKE_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_VPSBAKE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_VPSBAKE_DESCRIPTION "bakes triangle meshes into collision assets
Signed distance voxelmaps and point-sphere trees of arbitrary meshes, with
measured errors. Programs map them into memory and ask for contacts,
penetration, distances and forces, in Bullet or on their own (libvps-dev).")

set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_NAME libvps-dev)
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_SECTION libdevel)
# The libraries are static: programs also link their dependencies, which CMake finds by pkg-config.
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_DEPENDS "libhwy-dev, libstdc++-12-dev | libstdc++-dev, pkg-config")
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_SUGGESTS "vpsbake, libbullet-dev, cmake")
set(CPACK_DEBIAN_LIBVPS_DEV_DESCRIPTION "collision queries on assets that vpsbake bakes
Static libraries and headers for C and C++: the runtime, and a plug-in that
makes the assets collision shapes of Bullet. With files for CMake and
pkg-config, and a CMake function that bakes meshes as part of a build.")

set(CPACK_COMPONENTS_ALL runtime)
if(TARGET vpsbake)
  list(APPEND CPACK_COMPONENTS_ALL program)
endif()
foreach(bullet bullet bullet_float64)
  if(TARGET vps_${bullet})
    list(APPEND CPACK_COMPONENTS_ALL ${bullet})
  endif()
endforeach()
include(CPack)
cpack_add_component(program GROUP vpsbake)
foreach(component runtime bullet bullet_float64)
  cpack_add_component(${component} GROUP libvps_dev)
endforeach()
