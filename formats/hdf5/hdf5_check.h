// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads an asset with libhdf5 and compares it with the asset's own directory.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "formats/vps_format.h"

namespace vps {

/// Differences between the HDF5 file and the directory, one sentence each, at most 20. Empty when they agree: every
/// section is a contiguous dataset of its type, shape and place with the documented attributes, the root's attributes
/// are the directory's scalars, and there is nothing else. libhdf5 may crash on a forged file: call this in a child
/// process.
[[nodiscard]] std::vector<std::string> compare_with_hdf5(const std::filesystem::path& file, const Directory& directory);

/// Whether libhdf5 still finds the coarse layers of a voxelmap or the positions of a pointshell in a file whose
/// directory no longer fits, as after another HDF5 tool has rewritten the file. Call this in a child process, as above.
[[nodiscard]] bool hdf5_holds_sections(const std::filesystem::path& file);

}  // namespace vps
