#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Names the C++ files that clang-format 14 would change. Exit code 77: it is not installed.
set -eu
cd "$(dirname "$0")/../.."
format=$(command -v clang-format-14) || {
  echo "needs clang-format-14, which is absent"
  exit 77
}
find bake cli formats runtime sample_meshes tests \( -name '*.cpp' -o -name '*.h' \) -exec "$format" --dry-run -Werror {} +
