# SPDX-License-Identifier: Zlib
# Defines vps::libmujoco, MuJoCo itself, and VPS_MUJOCO_FOUND, in this build and for programs that use the installed adapter. Debian's own
# file for CMake names a folder that its package lacks, and wants OpenGL.
find_path(VPS_MUJOCO_INCLUDE_DIR mujoco/mujoco.h DOC "The folder of mujoco/mujoco.h")
find_library(VPS_MUJOCO_LIBRARY mujoco DOC "The library of MuJoCo")
set(VPS_MUJOCO_FOUND OFF)
if(VPS_MUJOCO_LIBRARY AND EXISTS "${VPS_MUJOCO_INCLUDE_DIR}/mujoco/mujoco.h")
  file(STRINGS ${VPS_MUJOCO_INCLUDE_DIR}/mujoco/mujoco.h version REGEX "define mjVERSION_HEADER +[0-9]+")
  string(REGEX MATCH "[0-9]+" version "${version}")
  # Collision functions filled mjContact in these versions. 2.2.2 is the one that is tested.
  if(version GREATER_EQUAL 220 AND version LESS 300)
    set(VPS_MUJOCO_FOUND ON)
  endif()
endif()
if(VPS_MUJOCO_FOUND AND NOT TARGET vps::libmujoco)
  add_library(vps::libmujoco INTERFACE IMPORTED GLOBAL)
  set_target_properties(vps::libmujoco PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${VPS_MUJOCO_INCLUDE_DIR}" INTERFACE_LINK_LIBRARIES "${VPS_MUJOCO_LIBRARY}")
endif()
