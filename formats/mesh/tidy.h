// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Checks a file's text, and tidies it, before CGAL's readers see it. Runs in the child process only. Internal to
/// mesh import.
///
/// CGAL 5.5.1 misreads some files without an error. A PLY property of an unknown type shifts all that follow. Some PLY
/// headers crash it. It reads files correctly that pass these checks.
#pragma once

#include <stdexcept>
#include <string>

namespace vps {

/// The file may be valid, but only assimp reads it correctly. `what()` says why.
struct NeedsAssimp : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Checks the whole body, ASCII or binary, then gives the bytes a plain PLY header.
/// @throw ReadError when no reader can read the file correctly, NeedsAssimp. The same for all functions here
void tidy_ply(std::string& bytes);

/// Blanks the names of solids of a text.
void tidy_stl(std::string& bytes);

}  // namespace vps
