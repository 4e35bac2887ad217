// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Distance from any point to the surface, by CGAL's AABB tree: for the certificate and thin walls. Internal to
/// bake.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "bake/geometry.h"

namespace vps::bake {

class ClosestPoint {
 public:
  /// @param surface  must outlive this object
  explicit ClosestPoint(const Surface& surface);
  ~ClosestPoint();
  ClosestPoint(ClosestPoint&&) noexcept;
  ClosestPoint& operator=(ClosestPoint&&) noexcept;

  /// Unsigned distance. Safe from several threads. [m]
  [[nodiscard]] double distance(const Vector& point) const;
  /// The same if only these triangles may be the nearest. Infinite without any.
  [[nodiscard]] double distance(const Vector& point, std::span<const std::uint32_t> among) const;

  struct Hit {
    double distance = std::numeric_limits<double>::infinity();  ///< [m]
    std::uint32_t triangle = 0;
  };
  /// The first triangle that a ray meets; at infinity when it meets none. Safe from several threads.
  /// @param direction  unit
  [[nodiscard]] Hit along_ray(const Vector& from, const Vector& direction) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace vps::bake
