#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs a build into a temporary folder, and builds and runs the programs beside this script against it.
# usage: run.sh BUILD VPSBAKE    VPSBAKE bakes their asset when the build has no program of its own
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
DESTDIR="$work" cmake --install "$1" --prefix /opt/vps >"$work/install.log" || { cat "$work/install.log"; exit 1; }
prefix=$work/opt/vps

vpsbake=$prefix/bin/vpsbake
[ -x "$vpsbake" ] || vpsbake=$2
"$vpsbake" "$here/../../sample_meshes/bolt.obj" --voxel 0.5mm -o "$work/bolt.vps.hdf"

export CFLAGS='-Wall -Wextra -pedantic -Werror' CXXFLAGS='-Wall -Wextra -Werror'
export CMAKE_PREFIX_PATH="$prefix"
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name vps.pc)")
export PKG_CONFIG_PATH

cp -r "$here/c" "$work/c"
make -s -C "$work/c"
"$work/c/deepest" "$work/bolt.vps.hdf"

configure() {
  cmake -S "$here/$1" -B "$work/$1" >"$work/$1.log" 2>&1
}
run() {
  configure "$1" || { cat "$work/$1.log"; exit 1; }
  cmake --build "$work/$1" >"$work/$1.log" || { cat "$work/$1.log"; exit 1; }
  "$work/$1/$2" "$work/bolt.vps.hdf"
}
run runtime overlap
if [ -f "$PKG_CONFIG_PATH/vps-bullet.pc" ]; then
  run bullet drop
  c++ $CXXFLAGS -std=c++20 "$here/bullet/drop.cpp" -o "$work/drop" $(pkg-config --cflags --libs vps-bullet)
  "$work/drop" "$work/bolt.vps.hdf"
elif configure bullet || ! grep -q 'vps was built without Bullet' "$work/bullet.log"; then
  echo 'find_package does not say that vps was built without Bullet'
  exit 1
fi
