#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# usage: tidy.sh BUILD JOBS [REGEX...]
# Runs clang-tidy with the checks of .clang-tidy on the sources of bake, cli, formats and runtime, or on those that match a
# regular expression. BUILD is configured and compiles each source separately. Exit code 1: there are warnings.
set -eu
cd "$(dirname "$0")/../.."
build=$1 jobs=$2
shift 2
[ $# -gt 0 ] || set -- '/(bake|cli|formats|runtime)/.*\.cpp$'
log=$(mktemp)
trap 'rm -f "$log" "$log.colours"' EXIT
status=0
# It continues after errors, so that the exit code covers all files. Counts of suppressed warnings are omitted.
# Its output has colours even in a file.
run-clang-tidy -quiet -p "$build" -j "$jobs" "$@" 2>/dev/null >"$log.colours" || status=1
sed 's/\x1b\[[0-9;]*m//g' "$log.colours" >"$log"
grep -v '^clang-tidy' "$log" || true
if grep -q ' warning: ' "$log"; then status=1; fi
exit $status
