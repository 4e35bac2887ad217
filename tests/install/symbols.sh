#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The functions that the shared library exports, those of its list of symbols and those of its headers are the same.
# usage: symbols.sh LIBRARY
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LC_ALL=C
nm -D --defined-only "$1" | awk '{ print $3 }' | sort >"$work/exported"
sed -n 's/^ \([^@]*\)@Base .*/\1/p' "$root/runtime/package/libvps0.symbols" >"$work/listed"
sed -n 's/^\(VpsStatus\|const char\*\) \(vps_[a-z_]*\)(.*/\2/p' "$root/runtime/vps.h" "$root/runtime/vps_asset.h" | sort >"$work/declared"
[ -s "$work/declared" ] || { echo 'no function found in runtime/vps.h'; exit 1; }
status=0
diff "$work/listed" "$work/exported" || {
  echo 'runtime/package/libvps0.symbols (<) and the library (>) differ: list what is new with its version; what is gone needs a new soname'
  status=1
}
diff "$work/declared" "$work/listed" || { echo 'runtime/vps.h (<) and runtime/package/libvps0.symbols (>) differ'; status=1; }
readelf -d "$1" | grep -q 'SONAME.*\[libvps\.so\.0\]' || { echo 'the soname is not libvps.so.0'; status=1; }
exit $status
