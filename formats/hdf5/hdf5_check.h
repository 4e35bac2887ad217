// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads an asset by libhdf5 and compares that with the asset's own directory.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/vps_format.h"

namespace vps {

/// What HDF5 says otherwise than the directory, one sentence each, at most 20; empty when they agree: every section is
/// a contiguous dataset of its type, shape and place with the documented attributes, the root's attributes are the
/// directory's scalars, and there is nothing else. libhdf5 may crash on a forged file: call it in a child process.
[[nodiscard]] std::vector<std::string> compare_with_hdf5(const std::filesystem::path& file, const Directory& directory);

/// Whether libhdf5 still finds all datasets of a voxelmap or a pointshell in a file whose directory no longer fits:
/// what is left by another HDF5 tool that wrote the file anew. In a child process, as above.
[[nodiscard]] bool hdf5_holds_sections(const std::filesystem::path& file);

}  // namespace vps
