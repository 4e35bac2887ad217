#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the Debian packages of a folder in a fresh minimal system of the host's release and mirror, uses them, and removes them.
# Exits with 77 if it cannot run: not root, no debootstrap, or no packages.
# usage: debian.sh PACKAGES
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
. "$root/tests/install/fresh_system.sh"
ls "$1"/vpsbake_*.deb "$1"/libvps0_*.deb "$1"/libvps-dev_*.deb >/dev/null 2>&1 || skip "no packages in $1: run make deb"
make_system system
system=$work/system
mkdir "$system/test"
cp "$1"/*.deb "$root/tests/install/python/depth.py" "$root/sample_meshes/bolt.obj" "$root/tests/install/runtime/overlap.cpp" \
  "$root/tests/install/c/deepest.c" "$root/tests/install/bullet/drop.cpp" "$root/docs/examples/nut_on_bolt_mujoco/nut_on_bolt.cpp" "$system/test"
cat >"$system/test/run" <<'END'
set -eux
export DEBIAN_FRONTEND=noninteractive LC_ALL=C
cd /test
get() {
  apt-get -q -y --no-install-recommends "$@" >log 2>&1 || { cat log; exit 1; }
}
get update
get install ./vpsbake_*.deb
[ "$(vpsbake --version | head -n 1)" = "vpsbake $(dpkg-query -W -f '${source:Upstream-Version}' vpsbake)" ]
vpsbake bolt.obj --voxel 0.5mm >/dev/null
vpsbake info bolt.vps.hdf | head -n 1
ldd /usr/bin/vpsbake | grep 'not found' && exit 1
get install ./libvps0_*.deb ./libvps-dev_*.deb g++
g++ -std=c++20 overlap.cpp -o overlap $(pkg-config --cflags --libs vps)
./overlap bolt.vps.hdf
gcc -std=c99 deepest.c -o deepest $(pkg-config --cflags --libs vps)
./deepest bolt.vps.hdf
gcc -std=c99 deepest.c -o deepest $(pkg-config --cflags --libs vps-shared)
./deepest bolt.vps.hdf
get install libbullet-dev libmujoco-dev
g++ -std=c++20 drop.cpp -o drop $(pkg-config --cflags --libs vps-bullet)
./drop bolt.vps.hdf
g++ -std=c++20 nut_on_bolt.cpp -o nut_on_bolt $(pkg-config --cflags --libs vps-mujoco)
packages='vpsbake libvps0 libvps-dev'
if ls python3-vps_*.deb >/dev/null 2>&1; then
  packages="$packages python3-vps python3-vps-bake python3-vps-bullet"
  get install ./python3-vps_*.deb
  python3 depth.py bolt.vps.hdf
  python3 -c 'import vps; print("vpsbake", vps.__version__)' | grep -qFx "$(vpsbake --version | head -n 1)"
  python3 -c 'import vps; vps.bake("bolt.obj", voxel=1e-3)' 2>&1 | grep -q 'install python3-vps-bake'
  get install ./python3-vps-bake_*.deb
  python3 -c 'import vps; vps.World()' 2>&1 | grep -q 'install python3-vps-bullet'
  get install ./python3-vps-bullet_*.deb
  python3 -c 'import vps; w = vps.World(); w.add(vps.bake("bolt.obj", voxel=1e-3)); w.step(); print(w.poses)'
fi
dpkg -L $packages >files
get purge $packages
while IFS= read -r file; do
  [ -d "$file" ] || [ ! -e "$file" ] || { echo "$file is left behind"; exit 1; }
done <files
for folder in /usr/include/vps /usr/lib/python3/dist-packages/vps /usr/share/doc/vpsbake /usr/share/doc/libvps*; do
  [ ! -e $folder ] || { echo "$folder is left behind"; exit 1; }
done
END
mkdir "$work/documents"
dpkg-deb -x "$1"/vpsbake_*.deb "$work/documents"
python3 -B "$root/tests/docs/links_test.py" "$work/documents/usr/share/doc/vpsbake"
chroot "$system" /bin/sh /test/run
