#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the Python package from the tree by pip, without a network, and uses it. Exits with 77 where pip or numpy is absent.
# usage: pip.sh PYTHON VPSBAKE
set -eu
here=$(cd "$(dirname "$0")" && pwd)
"$1" -c 'import numpy, pip' 2>/dev/null || { echo "needs Debian's python3-numpy and python3-pip"; exit 77; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# The baker would take minutes.
"$1" -m pip install --quiet --no-index --no-deps --target "$work/packages" --config-settings bake=off --config-settings bullet=off \
  "$here/../../runtime/python" >"$work/log" 2>&1 || { cat "$work/log"; exit 1; }
"$2" "$here/../../sample_meshes/bolt.obj" --voxel 0.5mm -o "$work/bolt.vps.hdf" >/dev/null 2>&1
PYTHONPATH="$work/packages" "$1" -B "$here/python/depth.py" "$work/bolt.vps.hdf"
version=$(PYTHONPATH="$work/packages" "$1" -B -c 'import vps; print(vps.__version__)')
"$1" -m pip list --path "$work/packages" 2>/dev/null | grep -q "^vps  *$version\$" ||
  { echo "pip does not list version $version of the package"; exit 1; }
