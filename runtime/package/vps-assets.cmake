# SPDX-License-Identifier: Zlib
# vpsbake_add_assets bakes meshes as part of a build. docs/cmake.md
include_guard(GLOBAL)
cmake_policy(VERSION 3.20) # the first that supports depfiles for Makefiles, too

# vpsbake_add_assets(TARGET FILES mesh... [VOXEL length] [OUTPUT_DIRECTORY folder] [CACHE folder] [OPTIONS option...])
#
# Adds TARGET to the build. It bakes every mesh into NAME.vps.hdf below OUTPUT_DIRECTORY [default: the current binary folder]. It bakes
# again when the mesh, one of its buffers, an option or the program changes. Meshes are relative to the current source folder, folders
# to the current binary folder. OPTIONS are passed to vpsbake, such as `--unit mm`; without VOXEL they must hold --resolution or
# --max-error. The target's property VPS_ASSETS lists the assets.
function(vpsbake_add_assets target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "VOXEL;OUTPUT_DIRECTORY;CACHE" "FILES;OPTIONS")
  if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES OR NOT arg_FILES)
    message(FATAL_ERROR "vpsbake_add_assets(${target}): write FILES mesh... [VOXEL 5mm] [OUTPUT_DIRECTORY folder] "
      "[CACHE folder] [OPTIONS option...], with a value for each; unexpected: '${arg_UNPARSED_ARGUMENTS}', "
      "without value: '${arg_KEYWORDS_MISSING_VALUES}'")
  endif()
  if(arg_VOXEL)
    list(APPEND arg_OPTIONS --voxel ${arg_VOXEL})
  elseif(NOT "${arg_OPTIONS}" MATCHES "(^|;)--(voxel|resolution|max-error)([=;]|$)")
    message(FATAL_ERROR "vpsbake_add_assets(${target}): write VOXEL 5mm, or --resolution or --max-error among OPTIONS")
  endif()
  if(NOT TARGET vps::vpsbake)
    message(FATAL_ERROR "vpsbake_add_assets(${target}): the program vpsbake is not found; install it beside the runtime or set "
      "VPSBAKE_EXECUTABLE to its path")
  endif()
  if(arg_CACHE)
    cmake_path(ABSOLUTE_PATH arg_CACHE BASE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}")
    list(APPEND arg_OPTIONS --cache "${arg_CACHE}")
  endif()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}")
  cmake_path(APPEND folder "${arg_OUTPUT_DIRECTORY}")
  cmake_path(NORMAL_PATH folder)
  file(MAKE_DIRECTORY "${folder}")

  set(assets "")
  foreach(mesh IN LISTS arg_FILES)
    cmake_path(ABSOLUTE_PATH mesh BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" NORMALIZE)
    cmake_path(GET mesh STEM LAST_ONLY name)
    cmake_path(APPEND folder "${name}.vps.hdf" OUTPUT_VARIABLE asset)
    get_property(other GLOBAL PROPERTY "VPS_MESH_OF_${asset}")
    if(other)
      message(FATAL_ERROR "vpsbake_add_assets(${target}): ${other} and ${mesh} would both become ${asset}; rename one, or give "
        "them folders of their own with OUTPUT_DIRECTORY")
    endif()
    set_property(GLOBAL PROPERTY "VPS_MESH_OF_${asset}" "${mesh}")
    add_custom_command(OUTPUT "${asset}"
      COMMAND vps::vpsbake "${mesh}" ${arg_OPTIONS} -o "${asset}" --depfile "${asset}.d"
      DEPENDS "${mesh}" "$<TARGET_FILE:vps::vpsbake>" DEPFILE "${asset}.d"
      COMMENT "Baking ${name}.vps.hdf" VERBATIM)
    list(APPEND assets "${asset}")
  endforeach()
  add_custom_target(${target} ALL DEPENDS ${assets} SOURCES ${arg_FILES})
  set_target_properties(${target} PROPERTIES VPS_ASSETS "${assets}")
endfunction()
