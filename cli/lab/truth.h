// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses of a body against a copy of itself with everything that the oracle says of them, for any size of body.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "cli/lab/oracle.h"
#include "cli/lab/pair.h"
#include "cli/lab/poses.h"
#include "cli/lab/wrench.h"
#include "formats/triangle_mesh.h"

namespace vps::lab {

/// What a pose is for.
enum class PoseKind : std::uint8_t { apart, contact, deep };

struct TruthOptions {
  std::size_t poses[3] = {50, 50, 50};  ///< that are sought: apart, in contact, deep
  double gap = 0;                       ///< the poses apart go as far. [Units: m]
  double contact = 0;                   ///< those in contact as deep. [Units: m]
  double deep = 0;                      ///< and the deep ones from there on. [Limits: value >= contact] [Units: m]
  double tolerance = 0;                 ///< of depths. [Limits: value > 0] [Units: m]
  std::uint64_t seed = 1;
  std::size_t most_work = 200000;  ///< of PoseOptions: twice what the hardest of 90 poses of a scan takes
  WrenchOptions wrench;
  /// "poses" or "forces", and how much of it is done, 0 to 1; from any thread. May be empty.
  std::function<void(const char* what, double fraction)> progress;
};

/// Relative to the body: gaps and contacts to 1/200 of its longest side, deep poses to 1/50; less for thin bodies, for
/// which a thickness of twice their volume over their area counts.
/// @param poses  in all, shared out evenly
[[nodiscard]] TruthOptions truth_options_for(const TriangleMesh& body, std::size_t poses);

struct TruePose {
  PairPose pose;
  PoseKind range = PoseKind::apart;
  ExactWrench wrench;  ///< zero where apart
};

struct GroundTruth {
  TruthOptions options;
  std::vector<TruePose> poses;
  std::size_t found[3] = {0, 0, 0};      ///< of them, by range: fewer than were sought where the oracle takes too long
  std::shared_ptr<const Oracle> oracle;  ///< of the body
  double force_rms[3] = {0, 0, 0};       ///< of the exact forces, by range. [m^3]
  double wrench_error = 0;               ///< the largest ExactWrench::error
  /// Forces are as exact as asked for: others judge nothing.
  [[nodiscard]] bool wrenches_exact() const { return wrench_error <= options.wrench.tolerance; }
};

enum class Wrenches : std::uint8_t { none, exact };

/// Computed, or read from what an earlier run left in `folder`.
/// @param body  closed, about its centre of mass
/// @throw MeasureError when the body is not manifold, no pose of contact is found or the folder fails
[[nodiscard]] GroundTruth find_truth(const TriangleMesh& body, const TruthOptions& options, Wrenches wrenches,
                                     const std::filesystem::path& folder);

}  // namespace vps::lab
