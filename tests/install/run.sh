#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs a build into a temporary folder, and builds and runs the programs beside this script against it.
# usage: run.sh BUILD VPSBAKE    VPSBAKE bakes their asset if the build has no program
set -eu
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
DESTDIR="$work" cmake --install "$1" --prefix /opt/vps >"$work/install.log" || { cat "$work/install.log"; exit 1; }
prefix=$work/opt/vps

vpsbake=$prefix/bin/vpsbake
if [ -x "$vpsbake" ]; then
  python3 -B "$here/../docs/links_test.py" "$prefix/share/doc/vpsbake"
else
  vpsbake=$2
fi
"$vpsbake" "$here/../../sample_meshes/bolt.obj" --voxel 0.5mm -o "$work/bolt.vps.hdf"

export CFLAGS='-Wall -Wextra -pedantic -Werror' CXXFLAGS='-Wall -Wextra -Werror'
export CMAKE_PREFIX_PATH="$prefix"
PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name vps.pc)")
export PKG_CONFIG_PATH

cp -r "$here/c" "$work/c"
make -s -C "$work/c"
"$work/c/deepest" "$work/bolt.vps.hdf"
make -s -C "$work/c" -B MODULE=vps-shared
for part in bolt nut; do
  "$vpsbake" "$here/../../sample_meshes/$part.obj" --voxel 0.2mm -o "$work/fine_$part.vps.hdf"
done
cc $CFLAGS -O2 -std=c99 "$here/../../docs/examples/penalty.c" -o "$work/penalty" $(pkg-config --cflags --libs vps-shared) -lm
LD_LIBRARY_PATH=$(dirname "$PKG_CONFIG_PATH") "$work/penalty" "$work/fine_bolt.vps.hdf" "$work/fine_nut.vps.hdf"
for program in deepest volume; do
  LD_LIBRARY_PATH=$(dirname "$PKG_CONFIG_PATH") "$work/c/$program" "$work/bolt.vps.hdf"
done
readelf -d "$work/c/deepest" | grep -q 'NEEDED.*libvps.so.0' || { echo 'vps-shared.pc does not link libvps.so.0'; exit 1; }

package=$(find "$prefix" -name _runtime.pyi)
if [ -n "$package" ] && /usr/bin/python3 -c 'import numpy' 2>/dev/null; then
  PYTHONPATH=$(dirname "$(dirname "$package")") /usr/bin/python3 -B "$here/python/depth.py" "$work/bolt.vps.hdf"
fi

# configure SOURCE BUILD [OPTION]
configure() {
  cmake -S "$here/$1" -B "$work/$2" ${3:-} >"$work/$2.log" 2>&1
}
# run SOURCE BUILD PROGRAM [OPTION]
run() {
  configure "$1" "$2" ${4:-} || { cat "$work/$2.log"; exit 1; }
  cmake --build "$work/$2" >"$work/$2.log" || { cat "$work/$2.log"; exit 1; }
  "$work/$2/$3" "$work/bolt.vps.hdf"
}
# drop FLAGS_OF LIBRARIES_OF: pkg-config modules
drop() {
  c++ $CXXFLAGS -std=c++20 "$here/bullet/drop.cpp" -o "$work/drop" $(pkg-config --cflags "$1") $(pkg-config --libs "$2")
}
run runtime runtime overlap
run shared shared deepest
# The shared library's own packages suffice for it.
for component in shared shared_dev; do
  cmake --install "$1" --prefix "$work/shared_alone" --component $component >"$work/install.log" || { cat "$work/install.log"; exit 1; }
done
(export CMAKE_PREFIX_PATH="$work/shared_alone" && run shared shared_alone_build deepest)
for bullet in bullet bullet_float64; do
  pc=vps-$(echo $bullet | tr _ -)
  if [ -f "$PKG_CONFIG_PATH/$pc.pc" ]; then
    run bullet $bullet drop -DBULLET=$bullet
    drop $pc $pc
    "$work/drop" "$work/bolt.vps.hdf"
  elif configure bullet $bullet -DBULLET=$bullet || ! grep -q 'vps was built without Bullet' "$work/$bullet.log"; then
    echo 'find_package does not say that vps was built without Bullet'
    exit 1
  fi
done
mujoco=../../docs/examples/nut_on_bolt_mujoco
if [ -f "$PKG_CONFIG_PATH/vps-mujoco.pc" ]; then
  configure $mujoco mujoco || { cat "$work/mujoco.log"; exit 1; }
  cmake --build "$work/mujoco" >"$work/mujoco.log" || { cat "$work/mujoco.log"; exit 1; }
  c++ $CXXFLAGS -std=c++20 "$here/$mujoco/nut_on_bolt.cpp" -o "$work/nut_on_bolt" $(pkg-config --cflags --libs vps-mujoco)
  for program in mujoco/nut_on_bolt nut_on_bolt; do
    "$work/$program" "$here/$mujoco/nut_on_bolt.xml" "$work/fine_bolt.vps.hdf" "$work/fine_nut.vps.hdf"
  done
elif configure $mujoco mujoco || ! grep -q 'vps was built without MuJoCo' "$work/mujoco.log"; then
  echo 'find_package does not say that vps was built without MuJoCo'
  exit 1
fi
if [ -x "$prefix/bin/vpsbake" ]; then
  configure baker baker || { cat "$work/baker.log"; exit 1; }
  cmake --build "$work/baker" >"$work/baker.log" || { cat "$work/baker.log"; exit 1; }
  "$work/baker/bake_here" "$here/../../sample_meshes/bolt.obj" "$work/bolt.vps.hdf"
elif configure baker baker || ! grep -q 'vps was built without the baker' "$work/baker.log"; then
  echo 'find_package does not say that vps was built without the baker'
  exit 1
fi
if [ -f "$PKG_CONFIG_PATH/vps-bullet-float64.pc" ]; then
  for one in '' -float64; do
    other=$([ -n "$one" ] || echo -float64)
    if drop vps-bullet$one vps-bullet$other 2>"$work/mixed.log" || ! grep -q 'vps::bullet::float' "$work/mixed.log"; then
      cat "$work/mixed.log"
      echo "a program for vps-bullet$one links with vps-bullet$other"
      exit 1
    fi
  done
fi
