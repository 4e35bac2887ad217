# SPDX-License-Identifier: GPL-3.0-or-later
# The last step of an installation: lists its files, one path below the prefix a line, for `make uninstall`.
set(list ${CMAKE_INSTALL_PREFIX}/share/doc/vpsbake/installed_files.txt)
set(lines "")
foreach(file IN LISTS CMAKE_INSTALL_MANIFEST_FILES ITEMS ${list})
  file(RELATIVE_PATH path "${CMAKE_INSTALL_PREFIX}" "${file}")
  string(APPEND lines "${path}\n")
endforeach()
file(WRITE "$ENV{DESTDIR}${list}" "${lines}")
