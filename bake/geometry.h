// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Vectors, the checked surface and the closest point on a triangle. Internal to bake.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

namespace vps::bake {

using Vector = Eigen::Vector3d;
using Triangle = std::array<std::uint32_t, 3>;

/// Triangles on numbered vertices, of any quality. Metres, asset frame.
struct Mesh {
  std::vector<Vector> vertices;
  std::vector<Triangle> triangles;

  [[nodiscard]] const Vector& corner(std::size_t triangle, int k) const {
    return vertices[triangles[triangle][static_cast<std::size_t>(k)]];
  }
  /// Normal by the right-hand rule; its length is twice the triangle's area.
  [[nodiscard]] Vector area_normal(std::size_t triangle) const {
    return (corner(triangle, 1) - corner(triangle, 0)).cross(corner(triangle, 2) - corner(triangle, 0));
  }
};

/// A mesh that has passed check_mesh: closed, wound outward, no degenerate triangle.
struct Surface : Mesh {
  std::vector<Vector> normals;  ///< outward, unit, one per triangle
  Vector bounds_min = Vector::Zero();
  Vector bounds_max = Vector::Zero();
  double area = 0;  ///< [m^2]
};

/// Closest point of a sliver to p. The regions of `closest_on_triangle` lose as many digits as the square of the
/// sliver's aspect ratio has. Edges lose none. So this finds the closest point of the edges first, and then tests the
/// face relative to that point.
[[gnu::noinline]] inline Vector closest_on_sliver(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector corners[3] = {a, b, c};
  Vector edges[3];
  Vector best = a;
  int longest = 0;
  for (int k = 0; k < 3; ++k) {
    edges[k] = corners[(k + 1) % 3] - corners[k];
    const double squared = edges[k].squaredNorm();
    const double along = squared > 0 ? edges[k].dot(p - corners[k]) / squared : 0;
    // Measured from the nearer end, so that both ends are reproduced exactly.
    const Vector q = along <= 0    ? corners[k]
                     : along < 0.5 ? Vector(corners[k] + along * edges[k])
                     : along < 1   ? Vector(corners[(k + 1) % 3] - (1 - along) * edges[k])
                                   : corners[(k + 1) % 3];
    if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
    if (squared > edges[longest].squaredNorm()) longest = k;
  }
  // The two shorter edges give the best normal.
  const Vector normal = edges[(longest + 1) % 3].cross(edges[(longest + 2) % 3]);
  const double length = normal.squaredNorm();
  // Thinner than rounding: only the edges count.
  if (!(length > 1e-24 * edges[longest].squaredNorm() * edges[longest].squaredNorm())) return best;
  Vector q = p - normal * (normal.dot(p - best) / length);
  for (int k = 0; k < 3; ++k) {
    if (normal.dot(edges[k].cross(q - corners[k])) < 0) return best;
  }
  return q;
}

/// Closest point of triangle abc to p, by Voronoi regions (Ericson, Real-Time Collision Detection, Sec. 5.1.5).
inline Vector closest_on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector ab = b - a;
  const Vector ac = c - a;
  const Vector ap = p - a;
  const double d1 = ab.dot(ap);
  const double d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector bp = p - b;
  const double d3 = ab.dot(bp);
  const double d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Vector cp = p - c;
  const double d5 = ab.dot(cp);
  const double d6 = ac.dot(cp);
  // A sliver has a small squared area against the longer edge's fourth power. The left side is four times the squared
  // area; ab.ac = d2 - d4.
  const double ab_squared = d1 - d3;
  const double ac_squared = d2 - d6;
  const double longer = ab_squared > ac_squared ? ab_squared : ac_squared;
  constexpr double kSliver = 1e-6;
  if (ab_squared * ac_squared - (d2 - d4) * (d2 - d4) < kSliver * longer * longer) return closest_on_sliver(p, a, b, c);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double scale = 1 / (va + vb + vc);
  return a + ab * (vb * scale) + ac * (vc * scale);
}

}  // namespace vps::bake
