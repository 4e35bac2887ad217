// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads a file with assimp, in single precision. Runs in the child process only. Internal to mesh import.
#pragma once

#include <string>

#include "formats/mesh/raw_mesh.h"

namespace vps {

/// Imports `path` with the loaders for `extension` only, walks the node tree with its transforms, and triangulates.
/// @param extension  in lower case, without the dot
/// @throw ReadError, std::bad_alloc
[[nodiscard]] RawMesh read_with_assimp(const std::string& path, const std::string& extension);

}  // namespace vps
