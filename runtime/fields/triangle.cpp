// SPDX-License-Identifier: Zlib
// Prepares a triangle, and finds its place that is nearest to a point.
#include "runtime/fields/triangle.h"

#include <algorithm>

namespace vps::detail {

bool Triangle::set(const double (&p)[3][3]) noexcept {
  const auto minus = [](const double(&a)[3], const double(&b)[3], double(&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = a[i] - b[i];
  };
  const auto cross = [](const double(&a)[3], const double(&b)[3], double(&out)[3]) {
    for (int i = 0; i < 3; ++i) out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
  };
  const auto dot = [](const double(&a)[3], const double(&b)[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  // Scales to unit length; false for a length within the rounding of floats at `scale`.
  const auto normalise = [&](double(&a)[3], double scale) {
    const double size = std::sqrt(dot(a, a));
    if (!(size > 1e-6 * scale)) return false;
    for (double& x : a) x /= size;
    return true;
  };
  const auto to_float = [](const double(&a)[3]) {
    return Vec3{static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
  };
  for (const auto& corner : p) {
    for (const double x : corner) {
      if (!(std::abs(x) <= 1e15)) return false;  // squares must fit into floats
    }
  }
  double edges[3][3];
  for (int i = 0; i < 3; ++i) minus(p[(i + 1) % 3], p[i], edges[i]);
  double n[3];
  cross(edges[0], edges[1], n);
  if (!normalise(n, std::max({dot(edges[0], edges[0]), dot(edges[1], edges[1]), dot(edges[2], edges[2])})))
    return false;
  normal = to_float(n);
  offset = static_cast<float>(dot(n, p[0]));
  for (int i = 0; i < 3; ++i) {
    double inwards[3];
    cross(n, edges[i], inwards);
    if (!normalise(inwards, 0)) return false;
    corners[i] = to_float(p[i]);
    side[i] = to_float(inwards);
    side_offset[i] = static_cast<float>(dot(inwards, p[i]));
  }
  centre = (1.0F / 3) * (corners[0] + corners[1] + corners[2]);
  for (const Vec3& corner : corners) radius = std::max(radius, length(corner - centre));
  radius *= 1 + 1e-6F;
  return true;
}

NearestPlace Triangle::nearest(Vec3 p) const noexcept {
  if (beyond(p) <= 0) return below(p);
  NearestPlace best;
  for (int i = 0; i < 3; ++i) {
    const Vec3 edge = corners[(i + 1) % 3] - corners[i];
    const float along = std::clamp(dot(p - corners[i], edge) / dot(edge, edge), 0.0F, 1.0F);
    const Vec3 at = corners[i] + along * edge;
    const Vec3 apart = p - at;
    const float squared = dot(apart, apart);
    if (squared < best.squared) best = {at, squared, false};
  }
  return best;
}

}  // namespace vps::detail
