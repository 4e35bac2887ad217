// SPDX-License-Identifier: GPL-3.0-or-later
// Ear clipping. Polygons of mesh files are small: the quadratic walk is enough.
#include "formats/mesh/triangulate.h"

#include <cmath>
#include <numeric>

namespace vps {
namespace {

using Point2 = std::array<double, 2>;

// Projects onto the coordinate plane that the Newell normal faces most, keeping the winding counter-clockwise.
std::vector<Point2> project(std::span<const std::array<double, 3>> corners) {
  std::array<double, 3> normal{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto& p = corners[i];
    const auto& q = corners[(i + 1) % corners.size()];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t u = (axis + 1) % 3;
      const std::size_t v = (axis + 2) % 3;
      normal[axis] += (p[u] - q[u]) * (p[v] + q[v]);
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

// Inside or on the border, corners that coincide with the triangle's own excepted.
bool blocks(const Point2& p, const Point2& a, const Point2& b, const Point2& c) {
  if (p == a || p == b || p == c) return false;
  return twice_area(a, b, p) >= 0 && twice_area(b, c, p) >= 0 && twice_area(c, a, p) >= 0;
}

bool is_ear(const std::vector<Point2>& flat, const std::vector<std::uint32_t>& ring, std::size_t at) {
  const std::size_t n = ring.size();
  const Point2& a = flat[ring[(at + n - 1) % n]];
  const Point2& b = flat[ring[at]];
  const Point2& c = flat[ring[(at + 1) % n]];
  if (!(twice_area(a, b, c) > 0)) return false;
  for (std::size_t k = 2; k < n - 1; ++k) {
    if (blocks(flat[ring[(at + k) % n]], a, b, c)) return false;
  }
  return true;
}

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(std::span<const std::array<double, 3>> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  const std::vector<Point2> flat = project(corners);
  std::vector<std::uint32_t> ring(corners.size());
  std::iota(ring.begin(), ring.end(), 0U);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  triangles.reserve(corners.size() - 2);
  while (ring.size() > 3) {
    const std::size_t n = ring.size();
    // Without an ear the polygon is degenerate: a flat corner costs nothing, and any corner keeps the mesh closed.
    std::size_t ear = n;
    std::size_t flat_corner = n;
    for (std::size_t at = 0; at < n && ear == n; ++at) {
      if (is_ear(flat, ring, at)) ear = at;
      const double area = twice_area(flat[ring[(at + n - 1) % n]], flat[ring[at]], flat[ring[(at + 1) % n]]);
      if (area == 0 && flat_corner == n) flat_corner = at;
    }
    if (ear == n) ear = flat_corner == n ? 0 : flat_corner;
    triangles.push_back({ring[(ear + n - 1) % n], ring[ear], ring[(ear + 1) % n]});
    ring.erase(ring.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({ring[0], ring[1], ring[2]});
  return triangles;
}

}  // namespace vps
