// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Poses of a body against a copy of itself, from just apart to deep, by an independent oracle.
///
/// The depth of a pose is the greatest depth of a point of the first body's surface below the second's surface. It is
/// found with CGAL's closest point and exact side, and a branch and bound over the triangles, which are cut until the
/// answer is within a tolerance. Where the bodies are apart, the depth is minus their distance, by FCL.
///
/// The wanted depths are spread evenly over ranges. For each depth, a rotation and a direction of approach are drawn
/// from a fixed seed. The first body then moves along that direction in steps of the missing depth. Such a step cannot
/// pass the wanted depth, so the body stops where it is first reached.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
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
  double tolerance = 1e-5;  ///< a pose is at most so much deeper than `depth` says. [Limits: value > 0] [Units: m]
  double arrival = 1e-6;    ///< a pose may be so much less deep than wanted. [Limits: value > 0] [Units: m]
  std::uint64_t seed = 1;   ///< of rotations and directions of approach
  /// Limit on the oracle's points for one pose. A pose that needs more is left out. After five such poses in a row the
  /// rest of the range is left out, and after a range without any pose all later ranges. 0: no limit; a depth that no
  /// approach reaches is then an error. The limit is not a time, so that every run has the same poses.
  std::size_t most_work = 0;
  /// Index of a range without which the others are of no use: where none of three poses spread over it is found
  /// first, each with `most_work`, there are no poses at all. Beyond the last range: none.
  std::size_t essential = std::numeric_limits<std::size_t>::max();
  std::function<void(std::size_t asked)> progress;  ///< takes the number of poses tried; may be empty
};

/// Computes poses, which takes minutes, or reads those that an earlier run left in `folder`. They are ordered by range
/// and, within a range, by wanted depth. There are fewer than wanted where `most_work` does not suffice.
/// @param body  closed, about its centre of mass
/// @throw MeasureError when a depth is not reached, or `folder` fails
[[nodiscard]] std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                               const std::filesystem::path& folder);

}  // namespace vps::lab
