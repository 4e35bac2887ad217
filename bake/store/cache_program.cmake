# SPDX-License-Identifier: GPL-3.0-or-later
# Writes a header that identifies the baking program: its version, its libraries and the hash of its sources. So no build
# takes assets from a cache that another build baked differently.
# usage: cmake -DOUTPUT=FILE -DPROGRAM=TEXT -DSOURCES=FILES -P cache_program.cmake
set(hashes "")
foreach(source IN LISTS SOURCES)
  file(SHA256 ${source} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 hash "${hashes}")
file(WRITE ${OUTPUT} "#pragma once\n#define VPSBAKE_CACHE_PROGRAM \"${PROGRAM}, sources ${hash}\"\n")
