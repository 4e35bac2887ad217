// SPDX-License-Identifier: GPL-3.0-or-later
// Ear clipping. Polygons of mesh files are small: the quadratic walk is enough.
#include "formats/mesh/triangulate.h"

#include <cmath>

namespace vps {
namespace {

using Point2 = std::array<double, 2>;

// Projects onto the coordinate plane that the Newell normal faces most, keeping the winding counter-clockwise.
// Dropping a coordinate keeps the others exact, so that the areas below are nearly exact for coordinates of floats.
std::vector<Point2> project(std::span<const std::array<double, 3>> corners) {
  // Relative to the first corner: far from the origin the sums would lose the polygon's size.
  const std::array<double, 3>& o = corners[0];
  std::array<double, 3> normal{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& p = corners[i];
    const auto& q = corners[(i + 1) % corners.size()];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3;
      const std::size_t v = (axis + 2) % 3;
      normal[axis] += (p[u] - q[u]) * ((p[v] - o[v]) + (q[v] - o[v]));
    }
  }
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (std::abs(normal[a]) > std::abs(normal[axis])) axis = a;
  }
  std::size_t u = (axis + 1) % 3;
  std::size_t v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  std::vector<Point2> flat;
  flat.reserve(corners.size());
  for (const auto& p : corners) flat.push_back({p[u], p[v]});
  return flat;
}

double twice_area(const Point2& a, const Point2& b, const Point2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// The corners not yet cut off, as a ring.
struct Ring {
  std::vector<Point2> flat;
  std::vector<std::uint32_t> corners;

  [[nodiscard]] std::size_t size() const { return corners.size(); }
  /// `at` may be past the end once: it wraps.
  [[nodiscard]] const Point2& point(std::size_t at) const { return flat[corners[at % corners.size()]]; }
  [[nodiscard]] double turn(std::size_t at) const {
    return twice_area(point(at + size() - 1), point(at), point(at + 1));
  }
};

// Whether corner `other` forbids cutting off the triangle a, b, c.
bool blocks(const Ring& ring, std::size_t other, const Point2& a, const Point2& b, const Point2& c) {
  const Point2& p = ring.point(other);
  if (p == a || p == c) return false;
  if (p == b) {
    // The outline touches itself at the tip of the ear: it must not pass through the ear's inside.
    for (const Point2& q : {ring.point(other + ring.size() - 1), ring.point(other + 1)}) {
      if (twice_area(a, b, q) > 0 && twice_area(b, c, q) > 0) return true;
    }
    return false;
  }
  return twice_area(a, b, p) >= 0 && twice_area(b, c, p) >= 0 && twice_area(c, a, p) >= 0;
}

bool is_ear(const Ring& ring, std::size_t at) {
  const std::size_t n = ring.size();
  const Point2& a = ring.point(at + n - 1);
  const Point2& b = ring.point(at);
  const Point2& c = ring.point(at + 1);
  if (!(twice_area(a, b, c) > 0)) return false;
  for (std::size_t k = 2; k < n - 1; ++k) {
    if (blocks(ring, (at + k) % n, a, b, c)) return false;
  }
  return true;
}

// The next corner to cut off, searched from `start`. Without an ear the polygon is degenerate: a flat corner costs no
// area, and any corner at all keeps the faces around it joined.
std::size_t next_corner(const Ring& ring, std::size_t start) {
  const std::size_t n = ring.size();
  for (std::size_t k = 0; k < n; ++k) {
    if (is_ear(ring, (start + k) % n)) return (start + k) % n;
  }
  for (std::size_t k = 0; k < n; ++k) {
    if (ring.turn((start + k) % n) == 0) return (start + k) % n;
  }
  return start % n;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const std::array<double, 3>> corners) {
  if (corners.size() < 3) return {};
  if (corners.size() == 3) return {{0, 1, 2}};
  Ring ring{project(corners), {}};
  for (std::uint32_t i = 0; i < corners.size(); ++i) {
    if (corners[i] != corners[i == 0 ? corners.size() - 1 : i - 1]) ring.corners.push_back(i);
  }
  if (ring.size() < 3) return {};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(ring.size() - 2);
  std::size_t start = 0;
  while (ring.size() > 3) {
    const std::size_t n = ring.size();
    const std::size_t ear = next_corner(ring, start);
    triangles.push_back({ring.corners[(ear + n - 1) % n], ring.corners[ear], ring.corners[(ear + 1) % n]});
    ring.corners.erase(ring.corners.begin() + static_cast<std::ptrdiff_t>(ear));
    // Continuing after the ear gives better shapes than a fan, and does not search the same corners again.
    start = ear + 1;
  }
  triangles.push_back({ring.corners[0], ring.corners[1], ring.corners[2]});
  return triangles;
}

}  // namespace vps
