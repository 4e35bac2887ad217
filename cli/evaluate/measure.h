// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Everything that a report says of one mesh.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cli/evaluate/errors.h"
#include "cli/evaluate/peers.h"
#include "cli/evaluate/settings.h"
#include "cli/evaluate/truth.h"

namespace vps::evaluate {

struct MeasureOptions {
  BakeOptions base;  ///< with a voxel size
  SweepSize size = SweepSize::full;
  TruthOptions truth;
  RoundOptions rounds;
  std::vector<std::string> without;  ///< peers that are left out
  std::filesystem::path cache;       ///< poses, forces and hulls are kept here
  std::filesystem::path work;        ///< assets are written here, and stay
  /// What is being done, and how much of that; from any thread. May be empty.
  std::function<void(const std::string& what, double fraction)> progress;
};

/// One point of the plots: a setting of ours, or a peer.
struct Row {
  std::string name;
  std::string series;
  std::string knob;    ///< of Setting; "peer"
  std::string remark;  ///< what the row is; may be empty
  std::optional<Setting> setting;
  std::size_t bytes = 0;  ///< of the asset's file; 0: there is none
  std::size_t points = 0;
  double field_bound = 0;      ///< of the certificate. [m]
  double covering_radius = 0;  ///< [m]
  double bake_seconds = 0;     ///< without the import; 0: not baked
  Times contacts;              ///< of all poses
  Times distances;             ///< of the poses apart
  Errors errors;
  Spread distance;             ///< error; of none asked: tells no distance in this row
  Held separation_held;        ///< bounds of `separation`, over all poses
  Held budget_held;            ///< delta_bound, with a level or a budget
  bool on_time_front = false;  ///< RMS of penetration in contact against the median time of a query
  bool on_bytes_front = false;
};

struct Measurement {
  Truth truth;
  std::array<double, 3> size{};  ///< of the mesh's bounds. [m]
  double bake_noise = 0;         ///< spread of three bakes of the base, over their median
  std::vector<Row> rows;         ///< the base first, peers last
  std::vector<LeftOut> left_out;
  std::vector<std::size_t> time_front, bytes_front;  ///< rows, from the cheapest
};

/// @param mesh    as imported: each setting bakes it as a user would, and may be refused
/// @param closed  as `closed_mesh` gives it for the base: what the truth is of and what peers get
/// @throw BakeError, MeasureError, std::runtime_error
[[nodiscard]] Measurement measure(const TriangleMesh& mesh, const TriangleMesh& closed, const MeasureOptions& options);

}  // namespace vps::evaluate
