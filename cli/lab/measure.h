// SPDX-License-Identifier: GPL-3.0-or-later
/// @file All measurements of a report for one mesh.
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
  int rotations = 8;                 ///< of the body in scenes
  std::vector<std::string> without;  ///< names of compared libraries to leave out, of `peer_names`
  RecordOf record;                   ///< may be empty
  std::filesystem::path cache;       ///< folder for poses, forces and hulls; empty: none is kept
  /// The present task and the finished share of it, 0 to 1. Called from any thread. May be empty.
  std::function<void(const std::string& what, double fraction)> progress;
};

struct Measurement {
  GroundTruth truth;
  std::array<double, 3> size{};  ///< sides of the mesh's bounds. [m]
  double bake_noise = 0;         ///< spread of the times of three bakes of the base, over their median; NaN: quick
  std::vector<Row> rows;         ///< the base first, other libraries last
  std::vector<LeftOut> left_out;
  std::vector<Front> fronts;
};

/// @param mesh    as imported. Each setting bakes it as a user would; a bake may fail
/// @param closed  from `closed_mesh` with the base's options; used for the truth and by the other libraries
/// @throw BakeError, MeasureError, std::runtime_error
[[nodiscard]] Measurement measure(const TriangleMesh& mesh, const TriangleMesh& closed, const MeasureOptions& options);

}  // namespace vps::lab
