# SPDX-License-Identifier: GPL-3.0-or-later
# Run by CPack between installing and packing: a Debian package has its documents in share/doc/PACKAGE, a copyright file and a
# changelog among them, and manual pages and changelogs are compressed, without times.
cmake_policy(VERSION 3.25)
set(source ${CMAKE_CURRENT_LIST_DIR}/../..)

# compress(FILE): FILE.gz instead
function(compress)
  execute_process(COMMAND gzip -9nf ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# complete(FOLDER PACKAGE): of what was installed into FOLDER
function(complete folder package)
  set(share ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${folder}/usr/share)
  if(NOT IS_DIRECTORY ${share})
    return()
  endif()
  if(NOT package STREQUAL "vpsbake")
    file(RENAME ${share}/doc/vpsbake ${share}/doc/${package})
  endif()
  set(doc ${share}/doc/${package})
  # All texts are in the copyright file, or in Debian's common-licenses.
  file(GLOB licences ${source}/LICENSES/*.txt)
  foreach(licence IN LISTS licences)
    cmake_path(GET licence FILENAME name)
    file(REMOVE ${doc}/${name})
  endforeach()
  file(REMOVE ${doc}/CHANGELOG.md)
  file(COPY ${source}/cli/package/debian/copyright DESTINATION ${doc})
  file(COPY_FILE ${source}/CHANGELOG.md ${doc}/changelog)
  set(PACKAGE vpsbake)
  configure_file(${source}/cli/package/debian/changelog.in ${doc}/changelog.Debian @ONLY)
  compress(${doc}/changelog ${doc}/changelog.Debian)
  file(GLOB pages ${share}/man/man1/*.1)
  if(pages)
    compress(${pages})
  endif()
endfunction()

complete(vpsbake vpsbake)
set(zsh ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/vpsbake/usr/share/zsh)
if(IS_DIRECTORY ${zsh})
  file(RENAME ${zsh}/site-functions ${zsh}/vendor-completions) # where Debian's zsh looks
endif()
complete(libvps_dev libvps-dev)
