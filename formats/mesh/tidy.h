// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Checks a file's text, and tidies it, before CGAL's readers see it. Runs in the child process only. Internal to
/// mesh import.
///
/// CGAL 5.5.1 reads much without a word that is not what the file says: a tab in an OBJ face ends the face, an OFF
/// header without its third number takes the sign off the first coordinate, a PLY property of an unknown type shifts
/// all that follow; some PLY headers crash it. What passes here, it reads rightly.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace vps {

/// The file may be in order, but only assimp reads it rightly. `what()` says what is special.
struct NeedsAssimp : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Blanks everything but positions and faces, and joins continued lines.
/// @return points and lines that were skipped
/// @throw ReadError when nobody can read the file rightly, NeedsAssimp. The same for all functions here
std::uint64_t tidy_obj(std::string& text);

/// Gives the text a plain OFF header, and blanks colours, normals and texture coordinates.
void tidy_off(std::string& text);

/// Gives the bytes, ASCII or binary, a plain PLY header, after walking through the whole body.
void tidy_ply(std::string& bytes);

/// Blanks the names of solids. A binary file needs assimp, which reads its floats as they are.
void tidy_stl(std::string& bytes);

}  // namespace vps
