#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# Removes the files that an installation listed, what Python compiled from them, and those of its own folders that are then empty.
# usage: uninstall.sh PREFIX
set -eu
list=share/doc/vpsbake/installed_files.txt
cd "$1" 2>/dev/null && [ -f $list ] || {
  echo "vpsbake is not installed in $1: there is no $list; give the PREFIX and DESTDIR of make install" >&2
  exit 1
}
files=$(cat $list)
echo "$files" | while IFS= read -r file; do
  rm -f -- "$file"
  folder=$(dirname "$file")
  case $file in *.py)
    rm -f -- "$folder/__pycache__/$(basename "$file" .py)".*.pyc
    rmdir "$folder/__pycache__" 2>/dev/null || true ;;
  esac
  # Folders that others use too, such as bin, stay.
  while case /$folder/ in */vps/* | */vpsbake/*) rmdir "$folder" 2>/dev/null ;; *) false ;; esac do
    folder=$(dirname "$folder")
  done
done
