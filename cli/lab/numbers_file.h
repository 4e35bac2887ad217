// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Keeps numbers that take long to compute in a text file. Its name has a hash of their inputs.
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/triangle_mesh.h"

namespace vps::lab {

/// `folder`/`name`_HASH.txt, with the hash of the mesh and the options. Empty when `folder` is empty: then nothing is
/// read or written.
[[nodiscard]] std::filesystem::path cache_file(const std::filesystem::path& folder, const std::string& name,
                                               const TriangleMesh& mesh, std::span<const double> options);

/// All numbers of the file; nothing when there is none.
[[nodiscard]] std::optional<std::vector<double>> read_numbers(const std::filesystem::path& file);

/// Writes the file whole or not at all.
/// @throw MeasureError
void write_numbers(const std::filesystem::path& file, std::span<const double> numbers);

}  // namespace vps::lab
