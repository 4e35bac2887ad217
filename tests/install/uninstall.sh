#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# `make uninstall` removes what `make install` installed, and no file of others.
# usage: uninstall.sh BUILD
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/opt/vps
mkdir -p "$prefix/bin" "$prefix/share/doc/vpsbake"
touch "$prefix/bin/other" "$prefix/share/doc/vpsbake/notes.txt"
DESTDIR="$work" cmake --install "$1" --prefix /opt/vps >"$work/log" || { cat "$work/log"; exit 1; }
[ -x "$prefix/bin/vpsbake" ] || { echo 'the program is not installed'; exit 1; }
package=$(find "$prefix" -path '*/vps/__init__.py')
if [ -n "$package" ]; then
  python3 -m compileall -q "$(dirname "$package")"
fi

make -s -C "$root" uninstall DESTDIR="$work" PREFIX=/opt/vps
left=$(cd "$prefix" && find . ! -type d | sort | paste -sd ' ')
[ "$left" = './bin/other ./share/doc/vpsbake/notes.txt' ] || { echo "these files are left: $left"; exit 1; }
left=$(cd "$prefix" && find . -type d -name 'vps*' | paste -sd ' ')
[ "$left" = ./share/doc/vpsbake ] || { echo "these folders are left: $left"; exit 1; }

if make -s -C "$root" uninstall DESTDIR="$work" PREFIX=/opt/vps 2>"$work/log" || ! grep -q "vpsbake is not installed in $prefix" "$work/log"; then
  echo 'a second make uninstall does not say that nothing is installed:'
  cat "$work/log"
  exit 1
fi
