// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses of a body against a copy of itself with the oracle's exact answers, for any size of body.
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

/// The range of depths that a pose belongs to.
enum class PoseKind : std::uint8_t { apart, contact, deep };

struct TruthOptions {
  std::size_t poses[3] = {50, 50, 50};  ///< number wanted: apart, in contact, deep
  double gap = 0;                       ///< largest distance of the poses apart. [Units: m]
  double contact = 0;                   ///< largest depth of the poses in contact. [Units: m]
  double deep = 0;                      ///< largest depth of the deep poses. [Limits: value >= contact] [Units: m]
  double tolerance = 0;                 ///< of depths. [Limits: value > 0] [Units: m]
  std::uint64_t seed = 1;
  std::size_t most_work = 200000;  ///< of PoseOptions: twice what the hardest of 90 poses of a scan takes
  WrenchOptions wrench;
  /// `what`: "poses" or "forces"; `fraction`: the finished share, 0 to 1. Called from any thread. May be empty.
  std::function<void(const char* what, double fraction)> progress;
};

/// Options relative to the body. Gaps and contacts go up to 1/200 of its longest side, deep poses up to 1/50. Contacts
/// go up to 1/16 and deep poses up to 1/4 of the thickness where that is less; the thickness is twice the volume over
/// the area.
/// @param poses  in all ranges together, shared evenly
[[nodiscard]] TruthOptions truth_options_for(const TriangleMesh& body, std::size_t poses);

struct TruePose {
  PairPose pose;
  PoseKind range = PoseKind::apart;
  ExactWrench wrench;  ///< zero where apart
};

struct GroundTruth {
  TruthOptions options;
  std::vector<TruePose> poses;
  std::size_t found[3] = {0, 0,
                          0};  ///< number of poses by range; fewer than wanted where the oracle needs too much work
  std::shared_ptr<const Oracle> oracle;  ///< of the body
  double force_rms[3] = {0, 0, 0};       ///< of the exact forces, by range. [m^3]
  double wrench_error = 0;               ///< the largest ExactWrench::error
  /// Whether forces reach the tolerance. Otherwise they are not compared with.
  [[nodiscard]] bool wrenches_exact() const { return wrench_error <= options.wrench.tolerance; }
};

enum class Wrenches : std::uint8_t { none, exact };

/// Computes poses and wrenches, or reads those that an earlier run left in `folder`.
/// @param body  closed, about its centre of mass
/// @throw MeasureError when the body is not manifold, no pose of contact is found, or `folder` fails
[[nodiscard]] GroundTruth find_truth(const TriangleMesh& body, const TruthOptions& options, Wrenches wrenches,
                                     const std::filesystem::path& folder);

}  // namespace vps::lab
