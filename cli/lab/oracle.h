// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reference answers about a mesh by CGAL: distance, side, and exact triangle-cube overlap.
#pragma once

#include <array>
#include <memory>
#include <stdexcept>

#include "formats/triangle_mesh.h"

namespace vps::lab {

/// A measurement that is not possible. `what()` is "reason; what to do".
struct MeasureError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Oracle {
 public:
  /// @pre a closed mesh without self-intersections, wound outward
  /// @throw MeasureError when parts of the surface share an edge or a corner
  explicit Oracle(const TriangleMesh& mesh);
  ~Oracle();
  /// Unsigned distance to the surface. [m]
  [[nodiscard]] double distance(const std::array<double, 3>& p) const;
  /// +1 inside, 0 on the surface, -1 outside.
  [[nodiscard]] int side(const std::array<double, 3>& p) const;
  /// The paper's V: positive inside. [m]
  [[nodiscard]] double penetration(const std::array<double, 3>& p) const { return side(p) * distance(p); }
  /// Direction in which V falls fastest at p, out of the body. Unit length; zero on the surface. [-]
  [[nodiscard]] std::array<double, 3> outward_normal(const std::array<double, 3>& p) const;
  /// Whether a direction points into the body through a triangle within `reach` of p: away from its outward side.
  [[nodiscard]] bool points_inward(const std::array<double, 3>& p, const std::array<double, 3>& direction,
                                   double reach) const;
  /// An upper bound on the depth of all points of a triangle: the largest distance of its corners to one face of the
  /// mesh. The distance to a face is convex, so its maximum is at a corner. [m]
  [[nodiscard]] double depth_bound(const std::array<std::array<double, 3>, 3>& triangle) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Distance to triangles in double. The triangles may be degenerate and need not be connected.
class SoupOracle {
 public:
  explicit SoupOracle(const TriangleMesh& mesh);
  ~SoupOracle();
  /// Unsigned distance. [m]
  [[nodiscard]] double distance(const std::array<double, 3>& p) const;
  /// A point of the triangles nearest to p.
  [[nodiscard]] std::array<double, 3> closest(const std::array<double, 3>& p) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Distance to the mesh in rational arithmetic, rounded once at the end. It decides when two answers in double differ.
/// Triangles whose boxes are farther than `at_most` are left out. [m]
/// @return infinity when no triangle is within `at_most`
[[nodiscard]] double exact_distance(const TriangleMesh& mesh, const std::array<double, 3>& p, double at_most);

/// Whether a closed triangle and a closed cube overlap, in rational arithmetic without rounding.
[[nodiscard]] bool touches_exactly(const std::array<std::array<double, 3>, 3>& triangle,
                                   const std::array<double, 3>& low, double edge);

}  // namespace vps::lab
