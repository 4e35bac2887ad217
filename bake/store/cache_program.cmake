# SPDX-License-Identifier: GPL-3.0-or-later
# Writes a header that names the program which bakes: its version, its libraries, and the hash of its sources, so that no
# build ever takes assets from a cache that another one baked otherwise.
# usage: cmake -DOUTPUT=FILE -DPROGRAM=TEXT -DSOURCES=FILES -P cache_program.cmake
set(hashes "")
foreach(source IN LISTS SOURCES)
  file(SHA256 ${source} hash)
  string(APPEND hashes ${hash})
endforeach()
string(SHA256 hash "${hashes}")
file(WRITE ${OUTPUT} "#pragma once\n#define VPSBAKE_CACHE_PROGRAM \"${PROGRAM}, sources ${hash}\"\n")
