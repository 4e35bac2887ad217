// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/inward_normal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "bake/stages/find_faces.h"

namespace vps::bake {
namespace {

// V around a point near the surface, trilinear between voxel centres. Looks each voxel up once.
class NearField {
 public:
  NearField(const Grid& grid, const InsideRuns& runs, const BandField& field, const Vector& centre)
      : grid_(grid), runs_(runs), field_(field) {
    const Vector g = at_voxels(centre);
    for (int axis = 0; axis < 3; ++axis) first_[axis] = cell_of(g[axis] - 1, axis);
    known_.fill(std::numeric_limits<double>::quiet_NaN());
  }

  // @param p  up to half a voxel from the centre along an axis
  [[nodiscard]] double at(const Vector& p) {
    const Vector g = at_voxels(p);
    std::uint32_t base[3];
    double w[3];
    for (int axis = 0; axis < 3; ++axis) {
      base[axis] = cell_of(g[axis], axis);
      w[axis] = g[axis] - base[axis];
    }
    double sum = 0;
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      const std::uint32_t dx = corner & 1;
      const std::uint32_t dy = corner >> 1 & 1;
      const std::uint32_t dz = corner >> 2;
      const double weight = (dx != 0 ? w[0] : 1 - w[0]) * (dy != 0 ? w[1] : 1 - w[1]) * (dz != 0 ? w[2] : 1 - w[2]);
      sum += weight * value(base[0] + dx, base[1] + dy, base[2] + dz);
    }
    return sum;
  }

 private:
  static constexpr std::uint32_t kEdge = 4;

  [[nodiscard]] Vector at_voxels(const Vector& p) const {
    return (p - grid_.origin) / grid_.voxel_size - Vector::Constant(0.5);
  }
  [[nodiscard]] std::uint32_t cell_of(double g, int axis) const {
    return static_cast<std::uint32_t>(std::clamp(std::floor(g), 0.0, grid_.dims[static_cast<std::size_t>(axis)] - 2.0));
  }
  [[nodiscard]] double value(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    double& known = known_[((k - first_[2]) * kEdge + j - first_[1]) * kEdge + i - first_[0]];
    if (std::isnan(known)) known = field_.value(grid_, runs_, i, j, k);
    return known;
  }

  const Grid& grid_;
  const InsideRuns& runs_;
  const BandField& field_;
  std::uint32_t first_[3];
  std::array<double, std::size_t{kEdge} * kEdge * kEdge> known_;
};

}  // namespace

Vector inward_normal(const Grid& grid, const InsideRuns& runs, const BandField& field, const Sample& sample) {
  const double h = grid.voxel_size / 2;
  NearField near(grid, runs, field, sample.position);
  Vector gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector step = h * Vector::Unit(axis);
    gradient[axis] = near.at(sample.position + step) - near.at(sample.position - step);
  }
  const double length = gradient.norm();
  constexpr double kTrust = 0.4;  // of the unit slope
  // On a face the gradient smooths details smaller than a voxel. If it deviates by more than 30 degrees, another face
  // has changed it. On an edge it halves the angle between the faces.
  const double least_cosine = sample.on_edge ? 0.2 : std::cos(std::numbers::pi / 6);
  if (!(length > kTrust * 2 * h) || -gradient.dot(sample.normal) < least_cosine * length) return -sample.normal;
  // The points of a flat face have one normal, so that rounding to codes does not tell them apart.
  const Vector normal = gradient / length;
  return (normal + sample.normal).norm() <= kFlatNormal ? Vector(-sample.normal) : normal;
}

}  // namespace vps::bake
