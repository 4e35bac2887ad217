#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Prints the sizes of a build's libraries and of their dependencies as a Markdown table.
# usage: runtime_size.sh BUILD
set -eu
build=$1
here=$(cd "$(dirname "$0")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
runtime="$build/runtime/libvps_runtime.a $build/formats/libvps_format.a"
bullet=$build/runtime/bullet/libvps_bullet.a
hwy=$(pkg-config --libs-only-l "$build/runtime/package/vps.pc" | tr ' ' '\n' | grep hwy || true)

row() {
  printf '| %s | %s kB | %s |\n' "$1" "$(($(stat -L -c %s "$2") / 1000))" "${3:-}"
}
needed() {
  readelf -d "$1" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p' | paste -sd ' '
}
# Links whole archives into one stripped shared library, which holds everything that a program can use.
shared() {
  out=$1
  shift
  c++ -s -shared -Wl,--as-needed -Wl,--whole-archive "$@" -Wl,--no-whole-archive $hwy -o "$work/$out"
}

shared runtime.so $runtime
cc -std=c99 -s -I"$here/../.." "$here/c/deepest.c" $runtime $hwy -lstdc++ -lm -o "$work/deepest"
printf '#include <stdio.h>\nint main(void) { return puts("") < 0; }\n' | cc -s -xc - -o "$work/empty"

echo '| | stripped | needs |'
echo '|---|---|---|'
row 'vps_runtime and vps_format as a shared library' "$work/runtime.so" "$(needed "$work/runtime.so")"
if [ -f "$bullet" ]; then
  shared bullet.so "$bullet"
  row 'vps_bullet as a shared library' "$work/bullet.so" 'the row above, Bullet'
fi
row 'a C program with the runtime in it (tests/install/c)' "$work/deepest" "$(needed "$work/deepest")"
row 'a C program that does nothing' "$work/empty" "$(needed "$work/empty")"
for library in $(ldd "$work/runtime.so" | sed -n 's/.*=> \(.*\) (.*/\1/p'); do
  row "$(basename "$library")" "$library"
done
if [ -f "$bullet" ]; then
  for name in LinearMath BulletCollision BulletDynamics; do
    library=$(c++ -print-file-name=lib$name.so)
    row "$(basename "$(readlink -f "$library")")" "$library"
  done
fi
