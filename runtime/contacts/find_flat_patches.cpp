// SPDX-License-Identifier: Zlib
// Area moments of the flat nodes of a point-sphere tree. Beyond the paper. Proofs: docs/internals/bounds.md, "Flat
// nodes".
#include <algorithm>
#include <cmath>

#include "runtime/contacts/traverse/traverse_query.h"

namespace vps {
namespace {

using namespace detail;

// Sums over points in double: the second moments of far points would lose digits.
struct Sum3 {
  double x = 0, y = 0, z = 0;
  void add(double weight, Vec3 v) noexcept {
    x += weight * double{v.x};
    y += weight * double{v.y};
    z += weight * double{v.z};
  }
  [[nodiscard]] Vec3 times(double factor) const noexcept {
    return {static_cast<float>(factor * x), static_cast<float>(factor * y), static_cast<float>(factor * z)};
  }
};

bool has_facets(const PointshellView& shell, IndexRange points) noexcept {
  const std::uint32_t* const end = shell.facet_points + shell.facets;
  const std::uint32_t* const next = std::lower_bound(shell.facet_points, end, points.begin);
  return next != end && *next < points.end;
}

// Sets all but the node. @return whether the points share a normal and have an area
bool set_moments(const PointshellView& shell, IndexRange points, FlatPatch& patch) noexcept {
  Sum3 normals;
  Sum3 centres;
  double area = 0;
  for (std::uint32_t i = points.begin; i < points.end; ++i) {
    const double weight = point_area(shell, i);
    normals.add(weight, point_inward_normal(shell, i));
    centres.add(weight, point_position(shell, i));
    area += weight;
  }
  const double size = std::sqrt(normals.x * normals.x + normals.y * normals.y + normals.z * normals.z);
  if (!(size > 0)) return false;
  const Vec3 n = patch.inward_normal = normals.times(1 / size);
  patch.area = static_cast<float>(size);
  patch.centre = centres.times(1 / area);
  const auto [u, v] = Tangents(n);
  double uu = 0;
  double uv = 0;
  double vv = 0;
  for (std::uint32_t i = points.begin; i < points.end; ++i) {
    if (!(length(point_inward_normal(shell, i) - n) <= kPatchNormal)) return false;
    const Vec3 off = point_position(shell, i) - patch.centre;
    const double weight = double{point_area(shell, i)} / area;
    const double a = double{dot(off, u)};
    const double b = double{dot(off, v)};
    uu += weight * a * a;
    uv += weight * a * b;
    vv += weight * b * b;
  }
  // The principal axes of the second moments, by half the angle of their deviator.
  const double mean = 0.5 * (uu + vv);
  const double deviation = std::hypot(0.5 * (uu - vv), uv);
  const double angle = 0.5 * std::atan2(uv, 0.5 * (uu - vv));
  const auto cosine = static_cast<float>(std::cos(angle));
  const auto sine = static_cast<float>(std::sin(angle));
  patch.along = static_cast<float>(std::sqrt(2 * (mean + deviation))) * (cosine * u + sine * v);
  patch.across = static_cast<float>(std::sqrt(2 * std::max(mean - deviation, 0.0))) * (cosine * v - sine * u);
  return true;
}

}  // namespace

Status find_flat_patches(const PointshellView& shell, std::vector<FlatPatch>& patches) {
  patches.clear();
  if (shell.points == 0) return Status::missing_part;
  if (shell.hull_offsets == nullptr) return Status::ok;
  for (std::uint32_t node = 0; node < shell.nodes; ++node) {
    if (shell.hull_offsets[node] == shell.hull_offsets[node + 1]) continue;
    const IndexRange points = points_below(shell, node);
    FlatPatch patch;
    patch.node = node;
    if (!has_facets(shell, points) && set_moments(shell, points, patch)) patches.push_back(patch);
  }
  return Status::ok;
}

}  // namespace vps
