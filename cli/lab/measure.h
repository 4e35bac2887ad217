// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Everything that a report says of one mesh.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "cli/lab/assets.h"
#include "cli/lab/rows.h"
#include "cli/lab/truth.h"

namespace vps::lab {

struct MeasureOptions {
  bake::BakeOptions base;  ///< with a voxel size
  SweepSize size = SweepSize::full;
  TruthOptions truth;
  RoundOptions rounds;
  std::vector<std::string> without;  ///< peers that are left out
  RecordOf record;                   ///< may be empty
  std::filesystem::path cache;       ///< poses, forces and hulls are kept here; empty: nowhere
  /// What is being done, and how much of that; from any thread. May be empty.
  std::function<void(const std::string& what, double fraction)> progress;
};

struct Measurement {
  GroundTruth truth;
  std::array<double, 3> size{};  ///< of the mesh's bounds. [m]
  double bake_noise = 0;         ///< spread of three bakes of the base, over their median
  std::vector<Row> rows;         ///< the base first, peers last
  std::vector<LeftOut> left_out;
  std::vector<Front> fronts;
};

/// @param mesh    as imported: each setting bakes it as a user would, and may be refused
/// @param closed  as `closed_mesh` gives it for the base: what the truth is of and what peers get
/// @throw BakeError, MeasureError, std::runtime_error
[[nodiscard]] Measurement measure(const TriangleMesh& mesh, const TriangleMesh& closed, const MeasureOptions& options);

}  // namespace vps::lab
