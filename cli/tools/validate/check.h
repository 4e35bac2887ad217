// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The checks of `vpsbake validate`; docs/assets.md says what each means.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

struct Check {
  enum class Result : std::uint8_t {
    ok,
    warning,  ///< the asset is usable, but this program would write something differently
    skipped,  ///< it could not be checked
    failed,   ///< the asset is unusable, or a statement in it is false
  };
  std::string name;
  Result result = Result::ok;
  std::string says;                ///< one line for people
  nlohmann::ordered_json figures;  ///< SI; null when there are none
};

/// Check `structure`: opens a file as the runtime does. @return false when the asset cannot be opened
bool check_structure(const std::filesystem::path& file, Asset& asset, std::vector<Check>& checks);

/// `hashes`, `hdf5`: whether the file agrees with its hashes, and its HDF5 part with its directory.
void check_file(const std::filesystem::path& file, const Asset& asset, std::vector<Check>& checks);

/// `values`, `faces NAME`, `spheres`, `areas`: properties of the sections that need no mesh.
void check_contents(const Asset& asset, std::vector<Check>& checks);

/// `format`, `generator`, `record`, `sections`: warnings at most.
void check_origin(const Asset& asset, std::vector<Check>& checks);

struct MeshCheckOptions {
  int samples = 10000;     ///< points for each check. [Limits: value >= 1]
  std::uint64_t seed = 1;  ///< of the points
};

/// Checks against the mesh, by an oracle that shares no code with the bake (CGAL): `mesh`, `mass`, `field NAME`, `far`,
/// `coarse layers`, `covering`, `points`, `normals`.
/// @param mesh  as the bake closed it
void check_against_mesh(const Asset& asset, const TriangleMesh& mesh, const MeshCheckOptions& options,
                        std::vector<Check>& checks);

}  // namespace vps::cli
