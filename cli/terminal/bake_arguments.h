// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Command-line arguments of one bake.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "bake/store/cache.h"
#include "bake/vps_bake.h"
#include "cli/terminal/verbosity.h"
#include "formats/mesh/mesh_import.h"

namespace vps::cli {

struct BakeArguments {
  std::string mesh;                              ///< "-": standard input
  std::string output;                            ///< empty: beside the mesh, NAME.vps.hdf
  double unit = 0;                               ///< metres per unit of the mesh's numbers; 0: not given, so 1
  double max_error = 0;                          ///< choose the voxel size for this error; 0: as in `options`. [m]
  bool default_grid = false;                     ///< no option sets the grid
  double scale = 1;                              ///< factor on the mesh, besides the unit
  std::vector<std::string> fields = {"scaled"};  ///< layers, scaled, real
  std::vector<std::string> parts = {"voxelmap", "pointshell"};
  ImportOptions import_options;  ///< its unit is set from `unit` and `scale`
  bake::BakeOptions options;
  std::string cache;            ///< folder of an AssetCache; empty: none
  std::size_t cache_bytes = 0;  ///< its limit; 0: none
  std::string depfile;          ///< to write for make or ninja; empty: none
  bool json = false;
  Verbosity verbosity = Verbosity::usual;
  bool dry_run = false;                                                 ///< bake nothing, print what would be baked
  std::size_t dry_run_above = std::numeric_limits<std::size_t>::max();  ///< the same if it would need more [bytes]
  unsigned threads = 0;                                                 ///< 0: all cores
};

/// The file of the mesh; of standard input a copy.
/// @throw ImportError where standard input cannot be used. The same for all functions here
[[nodiscard]] std::filesystem::path mesh_file(const BakeArguments& arguments);

/// Reads the mesh in metres. @throw ImportError
[[nodiscard]] ImportedMesh import_with(const BakeArguments& arguments);

/// The options with the parts and fields that were named.
[[nodiscard]] bake::BakeOptions complete_options(const BakeArguments& arguments);

/// The settings that the arguments give.
[[nodiscard]] bake::BakeSettings complete_settings(const BakeArguments& arguments);

/// @return a function from bake options to the record of the asset; the record is empty when the mesh cannot be read
[[nodiscard]] std::function<bake::BakeRecord(const bake::BakeOptions&)> record_maker(const BakeArguments& arguments);

}  // namespace vps::cli
