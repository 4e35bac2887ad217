# SPDX-License-Identifier: Zlib
# The option VPS_BUILD_MUJOCO, and MuJoCo. Without it nothing else changes.
if(NOT PROJECT_IS_TOP_LEVEL AND NOT VPS_BUILD_MUJOCO)
  return()
endif()

include(${CMAKE_CURRENT_LIST_DIR}/vps-find-mujoco.cmake)
set(found OFF)
# A scene of MuJoCo's is steps of its own library, without sanitizers.
if(VPS_MUJOCO_FOUND AND NOT (VPS_TSAN OR VPS_FUZZ))
  set(found ON)
endif()
option(VPS_BUILD_MUJOCO "Build the adapter for MuJoCo (needs MuJoCo 2.2 or 2.3)" ${found})
if(VPS_BUILD_MUJOCO AND NOT VPS_MUJOCO_FOUND)
  message(FATAL_ERROR "The adapter for MuJoCo needs MuJoCo 2.2 or 2.3 (Debian: libmujoco-dev): install it and set VPS_MUJOCO_INCLUDE_DIR "
    "and VPS_MUJOCO_LIBRARY where CMake does not find it, or switch VPS_BUILD_MUJOCO off")
elseif(NOT VPS_BUILD_MUJOCO)
  message(STATUS "No adapter for MuJoCo: VPS_BUILD_MUJOCO is off [default: on where MuJoCo 2.2 or 2.3 is found]")
endif()
