#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs a build into a temporary folder and builds docs/examples/cmake_project against it, with Ninja and with make. The build
# bakes the assets, and bakes them again only if their mesh or a buffer of it has changed.
# usage: cmake_project.sh BUILD
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
unset VPSBAKE_CACHE
DESTDIR="$work" cmake --install "$1" --prefix /opt/vps >"$work/log" || { cat "$work/log"; exit 1; }
export CMAKE_PREFIX_PATH="$work/opt/vps"

fail() {
  echo "$generator: $1"
  cat "$work/log"
  exit 1
}
# configure [OPTION]
configure() {
  cmake -G "$generator" -S "$project" -B "$project/build" "$@" >"$work/log" 2>&1
}
# expect NAMES: the assets that a build bakes
expect() {
  cmake --build "$project/build" >"$work/log" 2>&1 || fail 'the project does not build'
  baked=$(sed -n 's/.*Baking \(.*\)\.vps\.hdf.*/\1/p' "$work/log" | sort | paste -sd ' ')
  [ "$baked" = "$1" ] || fail "bakes '$baked', not '$1'"
}
# refuse WORDS: the project must not configure, with an error that contains these words
refuse() {
  if configure || ! tr -s '\n ' ' ' <"$work/log" | grep -qF "$1"; then fail "does not say: $1"; fi
  cp "$root/docs/examples/cmake_project/CMakeLists.txt" "$project"
}

for generator in Ninja 'Unix Makefiles'; do
  project="$work/a project"  # depfiles then contain names with spaces
  rm -rf "$project"
  cp -r "$root/docs/examples/cmake_project" "$project"
  configure || fail 'the project is not configured'
  expect 'bracket wedge'
  "$project/build/assembly" >"$work/log" || fail 'the program fails'
  grep -q '^at 20 mm: 0 points' "$work/log" || fail 'the wedge touches from afar'
  grep -q '^at 9 mm: [1-9]' "$work/log" || fail 'the wedge does not touch'
  expect ''
  # Makefiles compare times, which on some file systems have only the resolution of the kernel's ticks.
  sleep 0.1
  touch "$project/meshes/bracket.obj"
  expect bracket
  expect ''
  sleep 0.1
  touch "$project/meshes/wedge.bin"
  expect wedge
  expect ''
  sleep 0.1
  sed -i 's/VOXEL 1mm/VOXEL 2mm/' "$project/CMakeLists.txt"
  expect 'bracket wedge'
  "$CMAKE_PREFIX_PATH/bin/vpsbake" info "$project/build/assets/wedge.vps.hdf" | grep -q 'voxels of 2 mm' || fail 'the options are not taken'

  echo 'vpsbake_add_assets(again FILES meshes/../meshes/bracket.obj VOXEL 1mm OUTPUT_DIRECTORY assets)' >>"$project/CMakeLists.txt"
  refuse 'would both become'
  echo 'vpsbake_add_assets(other FILES meshes/bracket.obj)' >>"$project/CMakeLists.txt"
  refuse 'write VOXEL 5mm, or --resolution or --max-error'
  echo 'vpsbake_add_assets(other VOXEL 1mm)' >>"$project/CMakeLists.txt"
  refuse 'write FILES mesh...'
  cat >>"$project/CMakeLists.txt" <<'END'
vpsbake_add_assets(coarse FILES meshes/wedge.gltf OPTIONS --resolution 20 CACHE cache)
get_target_property(assets coarse VPS_ASSETS)
if(NOT assets STREQUAL "${CMAKE_CURRENT_BINARY_DIR}/wedge.vps.hdf")
  message(FATAL_ERROR "VPS_ASSETS is ${assets}")
endif()
END
  configure || fail 'the property VPS_ASSETS is not the list of assets'
  expect 'bracket wedge wedge'
  ls "$project/build/cache/"*/*.vps.hdf >/dev/null || fail 'the cache is not used'
done

# The runtime alone, without the program.
rm "$CMAKE_PREFIX_PATH/bin/vpsbake"
if command -v vpsbake >/dev/null; then exit 0; fi  # the one in PATH would be found
rm -rf "$project/build"
refuse 'the program vpsbake is not found: install it, or set VPSBAKE_EXECUTABLE to its path'
sed -i 's/ vpsbake)/)/' "$project/CMakeLists.txt"
refuse 'the program vpsbake is not found; install it beside the runtime'
