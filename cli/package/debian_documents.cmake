# SPDX-License-Identifier: GPL-3.0-or-later
# CPack runs it between installing and packing. A Debian package has its documents in share/doc/PACKAGE, with a copyright file and
# a changelog. Manual pages and changelogs are compressed, without times.
cmake_policy(VERSION 3.25)
set(source ${CMAKE_CURRENT_LIST_DIR}/../..)

# The day of the release, from the changelog.
file(READ ${source}/CHANGELOG.md changelog)
string(REGEX MATCH "## .${CPACK_PACKAGE_VERSION}. - ([0-9-]+)" heading "${changelog}")
execute_process(COMMAND date -u -R -d "${CMAKE_MATCH_1}" OUTPUT_VARIABLE RELEASE_DATE OUTPUT_STRIP_TRAILING_WHITESPACE
  COMMAND_ERROR_IS_FATAL ANY)

# compress(FILES...): replaces each FILE by FILE.gz
function(compress)
  execute_process(COMMAND gzip -9nf ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# complete(FOLDER PACKAGE): completes the documents of PACKAGE, which was installed into FOLDER
function(complete folder package)
  set(share ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${folder}/usr/share)
  if(NOT IS_DIRECTORY ${share})
    return()
  endif()
  if(NOT package STREQUAL "vpsbake")
    file(RENAME ${share}/doc/vpsbake ${share}/doc/${package})
  endif()
  set(doc ${share}/doc/${package})
  # The copyright file and Debian's common-licenses have all texts of licences; the documents of vpsbake link to them.
  if(NOT package STREQUAL "vpsbake")
    file(REMOVE_RECURSE ${doc}/LICENSES)
  endif()
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
  file(RENAME ${zsh}/site-functions ${zsh}/vendor-completions) # where Debian's zsh finds them
endif()
complete(libvps0 libvps0)
complete(libvps_dev libvps-dev)
complete(python3_vps python3-vps)
complete(python3_vps_bake python3-vps-bake)
complete(python3_vps_bullet python3-vps-bullet)
