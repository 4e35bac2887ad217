#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The archive of `make dist` builds the runtime and the program where no git is, and the program bakes. Exits with 77 where the sources
# are no clone made by git.
# usage: source_archive.sh WORK    WORK is a folder that is made anew
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$1
[ -e "$root/.git" ] || { echo 'skipped: the sources are no clone made by git'; exit 77; }
rm -rf "$work"
mkdir -p "$work/bin"
archive=$(make -s -C "$root" dist)
tar -xzf "$root/$archive" -C "$work"
version=$(basename "$archive" .tar.gz | sed 's/^vpsbake-//')
cd "$work/vpsbake-$version"

printf '#!/bin/sh\necho "git was called: $*" >>"%s"\nexit 1\n' "$work/calls" >"$work/bin/git"
chmod +x "$work/bin/git"
export PATH="$work/bin:$PATH"
cmake --preset release -DVPS_BUILD_LAB=OFF -DVPS_BUILD_PYTHON=OFF >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
cmake --build --preset release -j 2 --target vps_runtime vps_shared vpsbake >"$work/log" 2>&1 || { tail -n 50 "$work/log"; exit 1; }
[ ! -e "$work/calls" ] || { cat "$work/calls"; exit 1; }

vpsbake=$PWD/build/release/cli/vpsbake
[ "$("$vpsbake" --version | head -n 1)" = "vpsbake $version" ] || { echo "the program is not version $version"; exit 1; }
"$vpsbake" sample_meshes/bolt.obj --voxel 0.5mm -o "$work/bolt.vps.hdf"
"$vpsbake" validate "$work/bolt.vps.hdf"
cc -std=c99 -I. tests/install/c/deepest.c -o "$work/deepest" -Lbuild/release/runtime -lvps -Wl,-rpath,"$PWD/build/release/runtime"
"$work/deepest" "$work/bolt.vps.hdf"
if make dist >"$work/log" 2>&1 || ! grep -q 'make dist needs a clone made by git' "$work/log"; then
  echo 'make dist does not say that it needs a clone made by git'
  exit 1
fi
rm -rf "$work"
