// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses of a body against a copy of itself, from just apart to deep, by an oracle that is not ours.
///
/// The depth of a pose is the greatest depth of a point of the first body's surface below the second's: CGAL's closest
/// point and exact side, and a branch and bound over the triangles, which are cut until the answer is within a
/// tolerance. Where the bodies are apart it is minus their distance, by FCL. Depths are spread evenly over ranges. For
/// each, a rotation and a direction of approach are drawn from a fixed seed, and the first body comes along that
/// direction by what its depth still lacks: a step that cannot lead beyond, so that it stops where the depth is reached
/// first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

struct PairPose {
  Pose first_in_second;
  double depth = 0;       ///< of the first body in the second; negative: minus the distance. [m]
  std::size_t range = 0;  ///< of PoseOptions::ranges
};

struct DepthRange {
  std::size_t count = 0;  ///< poses
  double least = 0;       ///< depth; negative: minus the distance. [m]
  double most = 0;        ///< [m]
};

struct PoseOptions {
  std::vector<DepthRange> ranges{{400, -0.0002, 0.003}};
  double tolerance = 1e-5;  ///< how much deeper than told a pose may be. [Limits: value > 0] [Units: m]
  double arrival = 1e-6;    ///< how much a pose may lack of its depth. [Limits: value > 0] [Units: m]
  std::uint64_t seed = 1;   ///< of rotations and directions of approach
  /// Points that the oracle is asked of for one pose, which is then left out, after five in a row
  /// the rest of the range, and where a range has none the ranges after it; 0: no limit, and a depth that no approach
  /// reaches is an error. Not a time, so that every run has the same poses.
  std::size_t most_work = 0;
  std::function<void(std::size_t asked)> progress;  ///< may be empty
};

/// Poses range by range, fewer than asked for where `most_work` does not suffice, each in order of depth, computed,
/// which takes minutes, or read from what an earlier run has left in `folder`.
/// @param body  closed, about its centre of mass
/// @throw MeasureError when a depth is not reached, or `folder` fails
[[nodiscard]] std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                               const std::filesystem::path& folder);

}  // namespace vps::lab
