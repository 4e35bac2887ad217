#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# usage: tidy.sh BUILD JOBS [REGEX...]
# Runs clang-tidy with the checks of .clang-tidy on the sources of bake, cli, formats and runtime, or on those that match a
# regular expression. BUILD is configured and compiles each source separately. Exit code 1: there are warnings.
set -eu
cd "$(dirname "$0")/../.."
build=$1 jobs=$2
shift 2
[ $# -gt 0 ] || set -- "^$PWD/(bake|cli|formats|runtime)/.*\.cpp\$"
log=$(mktemp)
trap 'rm -f "$log" "$log.colours" "$log.errors"' EXIT
status=0
# It goes on after errors, so the exit code stands for all files. Counts of suppressed warnings are left out.
# It colours what it says even in a file.
run-clang-tidy -quiet -p "$build" -j "$jobs" "$@" >"$log.colours" 2>"$log.errors" || status=1
sed 's/\x1b\[[0-9;]*m//g' "$log.colours" >"$log"
grep -v '^clang-tidy' "$log" || true
# Of clang's own output only its counts of warnings are left out.
grep -v 'warnings* generated\.\|^Suppressed \|^Use -header-filter' "$log.errors" >&2 || true
if grep -q ' warning: ' "$log"; then status=1; fi
exit $status
