# SPDX-License-Identifier: Zlib
# The option VPS_BUILD_PYTHON, the interpreter and pybind11. Without pybind11 or Python's headers nothing else changes.
if(NOT PROJECT_IS_TOP_LEVEL AND NOT VPS_BUILD_PYTHON)
  return()
endif()

# Where there are several, that of the system, for which Debian's packages are.
if(NOT Python_EXECUTABLE AND EXISTS /usr/bin/python3)
  set(Python_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "The interpreter that the Python package is for")
endif()
set(PYBIND11_FINDPYTHON ON)
find_package(Python 3.9 QUIET COMPONENTS Interpreter Development.Module)
find_package(pybind11 CONFIG QUIET)
set(found OFF)
# Sanitizers would have to be part of the interpreter.
if(pybind11_FOUND AND Python_Development.Module_FOUND AND NOT (VPS_SANITIZE OR VPS_TSAN OR VPS_FUZZ))
  set(found ON)
endif()
option(VPS_BUILD_PYTHON "Build the Python package vps (needs pybind11 and Python's headers)" ${found})
if(VPS_BUILD_PYTHON AND NOT (pybind11_FOUND AND Python_Development.Module_FOUND))
  message(FATAL_ERROR "The Python package needs pybind11 and Python's headers (Debian: pybind11-dev, python3-dev): install them, or "
    "switch VPS_BUILD_PYTHON off")
elseif(NOT VPS_BUILD_PYTHON)
  message(STATUS "No Python package: VPS_BUILD_PYTHON is off [default: on where pybind11 and Python's headers are found]")
endif()

# Below the prefix. Debian's Python looks into lib/python3/dist-packages of /usr and lib/pythonX.Y/dist-packages of /usr/local.
if(VPS_BUILD_PYTHON AND NOT VPS_PYTHON_DIR)
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr" AND EXISTS /etc/debian_version)
    set(dir lib/python3/dist-packages)
  elseif(EXISTS /etc/debian_version AND Python_EXECUTABLE MATCHES "^/usr/bin/")
    set(dir lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/dist-packages)
  else()
    set(dir lib/python${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}/site-packages)
  endif()
  set(VPS_PYTHON_DIR ${dir})  # not in the cache: another prefix is another folder
endif()
