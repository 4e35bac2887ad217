// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The point of a shell that is nearest to a place.
#pragma once

#include <cmath>
#include <limits>

#include "bake/point_grid.h"
#include "runtime/vps_runtime.h"

namespace vps::cli {

class NearestPoint {
 public:
  /// @param spacing  approximate distance between neighbours. [Limits: value > 0] [Units: m]
  NearestPoint(const PointshellView& shell, double spacing) : shell_(shell), cell_(spacing), grid_(spacing) {
    for (std::uint32_t i = 0; i < shell.points; ++i) grid_.insert(at(i), i);
  }

  struct Found {
    std::uint32_t point = 0;
    double distance = std::numeric_limits<double>::infinity();  ///< [m]
  };
  [[nodiscard]] Found operator()(const Eigen::Vector3d& p) const {
    Found best;
    const auto offer = [&](std::uint32_t i) {
      const double distance = (at(i) - p).norm();
      if (distance < best.distance) best = {i, distance};
    };
    constexpr int kWidest = 64;  // [cells]; farther away all points are tested
    for (int reach = 1; reach <= kWidest; reach *= 4) {
      grid_.for_each_near(p, reach, offer);
      if (best.distance <= reach * cell_) return best;
    }
    for (std::uint32_t i = 0; i < shell_.points; ++i) offer(i);
    return best;
  }

 private:
  [[nodiscard]] Eigen::Vector3d at(std::uint32_t i) const {
    const Vec3 p = point_position(shell_, i);
    return {double(p.x), double(p.y), double(p.z)};
  }

  const PointshellView& shell_;
  double cell_;
  bake::PointGrid grid_;
};

}  // namespace vps::cli
