# SPDX-License-Identifier: GPL-3.0-or-later
# The Debian packages vpsbake, the program, libvps0, the shared library, libvps-dev, the other libraries, python3-vps,
# python3-vps-bake and python3-vps-bullet, the Python package: run `cpack` in a build of the preset deb, or `make deb`.
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

set(CPACK_DEBIAN_LIBVPS0_PACKAGE_NAME libvps0)
set(CPACK_DEBIAN_LIBVPS0_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBVPS0_PACKAGE_SHLIBDEPS ON)
# dpkg reads files of these names.
set(control ${PROJECT_BINARY_DIR}/debian)
configure_file(${PROJECT_SOURCE_DIR}/runtime/package/libvps0.symbols ${control}/symbols COPYONLY)
file(WRITE ${control}/shlibs "libvps 0 libvps0 (>= ${PROJECT_VERSION})\n")
file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBVPS0_PACKAGE_CONTROL_EXTRA ${control}/symbols ${control}/shlibs ${control}/triggers)
set(CPACK_DEBIAN_LIBVPS0_DESCRIPTION "collision queries on assets that vpsbake bakes, shared library
Maps assets into memory and answers contact, penetration, distance and force
queries, for many points and poses at once. This package has the C interface
as a shared library.")

set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_NAME libvps-dev)
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_SECTION libdevel)
# Most of the libraries are static: programs also link their dependencies, which CMake finds by pkg-config.
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_DEPENDS "libhwy-dev, libstdc++-12-dev | libstdc++-dev, pkg-config")
set(CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_SUGGESTS "vpsbake, libbullet-dev, libmujoco-dev, cmake")
set(CPACK_DEBIAN_LIBVPS_DEV_DESCRIPTION "collision queries on assets that vpsbake bakes
Libraries and headers for C and C++: the runtime, its C interface also as a
shared library, a plug-in that makes the assets collision shapes of Bullet,
and an adapter that makes them collision geometry of MuJoCo. With files for
CMake and pkg-config, and a CMake function that bakes meshes as part of a
build.")

# An extension module is for one minor version of Python 3.
set(minor "${Python_VERSION_MINOR}")
math(EXPR next_minor "0${minor} + 1")
set(version_of_python "python3 (>= 3.${minor}), python3 (<< 3.${next_minor})")
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_NAME python3-vps)
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_DEPENDS "${version_of_python}, python3-numpy")
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_SUGGESTS "python3-vps-bake, python3-vps-bullet")
set(CPACK_DEBIAN_PYTHON3_VPS_PACKAGE_CONTROL_EXTRA
  ${CMAKE_CURRENT_LIST_DIR}/debian/python3-vps/postinst ${CMAKE_CURRENT_LIST_DIR}/debian/python3-vps/prerm)
set(CPACK_DEBIAN_PYTHON3_VPS_DESCRIPTION "collision queries on assets that vpsbake bakes, for Python
Signed distances, closest points, rays, contacts, separation and time of
impact for numpy arrays of points and poses.")

set(CPACK_DEBIAN_PYTHON3_VPS_BAKE_PACKAGE_NAME python3-vps-bake)
set(CPACK_DEBIAN_PYTHON3_VPS_BAKE_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3_VPS_BAKE_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON3_VPS_BAKE_PACKAGE_DEPENDS "python3-vps (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}), ${version_of_python}")
set(CPACK_DEBIAN_PYTHON3_VPS_BAKE_DESCRIPTION "bakes triangle meshes into collision assets, for Python
The part of the Python package vps that bakes meshes from numpy arrays, mesh
files and objects with vertices and faces.")

set(CPACK_DEBIAN_PYTHON3_VPS_BULLET_PACKAGE_NAME python3-vps-bullet)
set(CPACK_DEBIAN_PYTHON3_VPS_BULLET_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON3_VPS_BULLET_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON3_VPS_BULLET_PACKAGE_DEPENDS "${CPACK_DEBIAN_PYTHON3_VPS_BAKE_PACKAGE_DEPENDS}")
set(CPACK_DEBIAN_PYTHON3_VPS_BULLET_DESCRIPTION "small Bullet world of baked bodies, for Python
The part of the Python package vps that simulates baked bodies, boxes and
spheres in Bullet, for trying collision assets and for tests.")

set(CPACK_COMPONENTS_ALL runtime)
if(TARGET vpsbake)
  list(APPEND CPACK_COMPONENTS_ALL program)
endif()
if(TARGET vps_shared)
  string(PREPEND CPACK_DEBIAN_LIBVPS_DEV_PACKAGE_DEPENDS "libvps0 (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}), ")
  list(APPEND CPACK_COMPONENTS_ALL shared shared_dev)
endif()
if(TARGET vps_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
foreach(part bake bullet)
  if(TARGET vps_python_${part})
    list(APPEND CPACK_COMPONENTS_ALL python_${part})
  endif()
endforeach()
foreach(adapter bullet bullet_float64 mujoco)
  if(TARGET vps_${adapter})
    list(APPEND CPACK_COMPONENTS_ALL ${adapter})
  endif()
endforeach()
include(CPack)
cpack_add_component(program GROUP vpsbake)
cpack_add_component(shared GROUP libvps0)
cpack_add_component(python GROUP python3_vps)
cpack_add_component(python_bake GROUP python3_vps_bake)
cpack_add_component(python_bullet GROUP python3_vps_bullet)
foreach(component runtime shared_dev bullet bullet_float64 mujoco)
  cpack_add_component(${component} GROUP libvps_dev)
endforeach()
