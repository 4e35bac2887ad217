// SPDX-License-Identifier: GPL-3.0-or-later
// The paper stores its layers up to the medial axis, voxel by voxel (Sec. 2.1.1). Far from the surface a coarse grid of
// exact distances suffices.
#include "bake/stages/far_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/plan.h"
#include "bake/uniform.h"

namespace vps::bake {
namespace {

constexpr double kRange_vx = 11;
constexpr int kLeastSpacing_vx = 4;
constexpr int kMostSpacing_vx = 64;
// The search for the certificate's worst point moves by less than a spacing.
static_assert(kFarReach_vx > 1.001 * kRange_vx + 2 * kMostSpacing_vx);

// Lower bound of a point's distance, from the coarse layers: docs/internals/bounds.md, "Anywhere". [m]
double least_distance(const FarSource& from, const Vector& p) {
  const Grid& grid = from.grid;
  Vector nearest;
  std::uint32_t brick[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = static_cast<double>(grid.dims[static_cast<std::size_t>(axis)] - 1);
    const double voxel = std::clamp((p[axis] - grid.origin[axis]) / grid.voxel_size, 0.5, last + 0.5);
    nearest[axis] = grid.origin[axis] + voxel * grid.voxel_size;
    brick[axis] = static_cast<std::uint32_t>(voxel) / kBrickEdge;
  }
  const Vector centre =
      grid.origin + kBrickEdge * grid.voxel_size * (Vector(brick[0], brick[1], brick[2]) + Vector::Constant(0.5));
  const double layer = std::abs(from.coarse_layers[grid.brick_at(brick[0], brick[1], brick[2])]);
  const double inner = std::max(layer * grid.voxel_size - (nearest - centre).norm(), 0.0);
  return std::hypot((p - nearest).norm(), inner);
}

// Whether a point is inside. A brick's coarse layer decides farther from the surface than the brick's centre is from
// the point: docs/internals/bounds.md, "Coarse layers".
bool is_inside(const FarSource& from, const Vector& p) {
  const Grid& grid = from.grid;
  const Vector at = (p - grid.origin) / (kBrickEdge * grid.voxel_size);
  std::uint32_t brick[3];
  for (int axis = 0; axis < 3; ++axis) {
    if (!(at[axis] >= 0 && at[axis] < grid.brick_dims[static_cast<std::size_t>(axis)])) return from.inside.inside(p);
    brick[axis] = static_cast<std::uint32_t>(at[axis]);
  }
  const int layer = from.coarse_layers[grid.brick_at(brick[0], brick[1], brick[2])];
  const Vector from_centre = at - Vector(brick[0] + 0.5, brick[1] + 0.5, brick[2] + 0.5);
  if (std::abs(layer) > kBrickEdge * from_centre.norm() + 1e-6) return layer > 0;
  return from.inside.inside(p);
}

// V, but -most where the point is outside and farther than that.
// @param distance_of  distance of a point, or any value from `enough` on. [m]
template <class DistanceOf>
double penetration_down_to(double most, const FarSource& from, const Vector& p, DistanceOf distance_of) {
  const bool within = is_inside(from, p);
  if (!within && least_distance(from, p) >= most) return -most;
  const double enough = within ? std::numeric_limits<double>::infinity() : most + from.distances.slack;
  const double distance = distance_of(p, enough);
  return within ? distance : -std::min(distance, most);
}
double exact_down_to(double most, const FarSource& from, const Vector& p) {
  return penetration_down_to(most, from, p, [&](const Vector& at, double) {
    return from.distances.exact(at, from.distances.tree.distance(at));
  });
}
// The same but for rounding. @param at_most  an upper bound of the distance. [m]
double fast_down_to(double most, const FarSource& from, const Vector& p, double at_most) {
  return penetration_down_to(most, from, p, [&](const Vector& at, double enough) {
    return from.distances.tree.distance(at, std::min(at_most, enough));
  });
}

// A grid with a spacing of `spacing` voxels, without values.
FarField plan_far(const FarSource& from, int spacing) {
  FarField far;
  far.range = kRange_vx * from.grid.voxel_size;
  far.spacing = spacing * from.grid.voxel_size;
  // A little wider than the range, so that rounding leaves no gap.
  const Vector margin = Vector::Constant(1.001 * far.range);
  far.origin = from.surface.bounds_min - margin;
  const Vector cells = (from.surface.bounds_max + margin - far.origin) / far.spacing;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    far.dims[axis] = static_cast<std::uint32_t>(std::ceil(cells[static_cast<Eigen::Index>(axis)])) + 1;
  }
  return far;
}

std::size_t node_count(const FarField& far) {
  return std::size_t{far.dims[0]} * far.dims[1] * far.dims[2];
}

Vector node_at(const FarField& far, std::size_t node) {
  const std::size_t x = node % far.dims[0];
  const std::size_t y = node / far.dims[0] % far.dims[1];
  const std::size_t z = node / far.dims[0] / far.dims[1];
  return far.origin + far.spacing * Vector(static_cast<double>(x), static_cast<double>(y), static_cast<double>(z));
}

void sample_nodes(const FarSource& from, FarField& far) {
  // Interpolation near the range must not meet clamped values.
  const double most = far.range + far.spacing;
  std::vector<double> sampled(node_count(far));
  tbb::parallel_for(std::size_t{0}, std::size_t{far.dims[1]} * far.dims[2], [&](std::size_t row) {
    double at_most = std::numeric_limits<double>::infinity();
    for (std::size_t n = row * far.dims[0]; n < (row + 1) * far.dims[0]; ++n) {
      const double v = sampled[n] = fast_down_to(most, from, node_at(far, n), at_most);
      // Distances are 1-Lipschitz. The clamped one says nothing.
      at_most =
          v > -most ? std::abs(v) + far.spacing + 2 * from.distances.slack : std::numeric_limits<double>::infinity();
    }
  });
  // Exact where rounding matters: for the deepest node, which sets the step, and for values between two steps.
  const double slack = from.distances.slack;
  const double about = *std::max_element(sampled.begin(), sampled.end());
  double deepest = from.grid.voxel_size;
  for (std::size_t n = 0; n < sampled.size(); ++n) {
    if (sampled[n] >= about - slack) deepest = std::max(deepest, exact_down_to(most, from, node_at(far, n)));
  }
  far.step_outer = most / kLargestFarValue;
  far.step_inner = deepest / kLargestFarValue;
  far.values.resize(sampled.size());
  tbb::parallel_for(std::size_t{0}, sampled.size(), [&](std::size_t n) {
    const auto steps = [&](double v) { return v / (v > 0 ? far.step_inner : far.step_outer); };
    double v = steps(sampled[n]);
    const double from_half = std::abs(v - std::floor(v) - 0.5);
    if (from_half * std::min(far.step_inner, far.step_outer) <= slack)
      v = steps(exact_down_to(most, from, node_at(far, n)));
    far.values[n] = static_cast<std::int8_t>(std::lrint(v));
  });
}

void certify_far(const FarSource& from, double least, FarField& far) {
  std::vector<CertificateSample> samples(enough_places(node_count(far), 2, 8192));
  std::vector<std::uint8_t> used(samples.size(), 0);
  const Vector size(far.dims[0] - 1, far.dims[1] - 1, far.dims[2] - 1);
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    const std::uint64_t counter = 3 * static_cast<std::uint64_t>(n);
    const Vector part(uniform(counter), uniform(counter + 1), uniform(counter + 2));
    CertificateSample& sample = samples[n];
    sample.point = far.origin + far.spacing * part.cwiseProduct(size);
    const auto is_covered = [&](double v, double slack) {
      return v >= -far.range - slack && std::abs(v) >= least - slack;
    };
    const double slack = from.distances.slack;
    const double about =
        fast_down_to(far.range + 2 * slack, from, sample.point, std::numeric_limits<double>::infinity());
    if (!is_covered(about, slack)) return;
    sample.penetration = exact_down_to(2 * far.range, from, sample.point);
    used[n] = is_covered(sample.penetration, 0) ? 1 : 0;
  });
  std::size_t kept = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    if (used[n] != 0) samples[kept++] = samples[n];
  }
  samples.resize(kept);
  const Reconstruction value = [&](const Vector& p) { return far.value(p); };
  far.error = certify(samples, value);
  const double deepest = far.step_inner * kLargestFarValue + far.spacing;
  find_worst(samples, value, {from.distances, from.inside, far.spacing, deepest, far.range, least, 64}, far.error);
  // Proven: docs/internals/bounds.md, "The far grid".
  far.error.bound = std::sqrt(0.75) * far.spacing + 0.5 * std::max(far.step_inner, far.step_outer);
}

}  // namespace

double FarField::value(const Vector& point) const {
  const Vector at = (point - origin) / spacing;
  std::size_t low[3];
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = static_cast<double>(dims[static_cast<std::size_t>(axis)] - 2);
    low[axis] = static_cast<std::size_t>(std::clamp(std::floor(at[axis]), 0.0, last));
  }
  double sum = 0;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t node[3] = {low[0] + (corner & 1), low[1] + (corner >> 1 & 1), low[2] + (corner >> 2)};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      weight *= 1 - std::abs(at[static_cast<Eigen::Index>(axis)] - static_cast<double>(node[axis]));
    }
    const double v = values[(node[2] * dims[1] + node[1]) * dims[0] + node[0]];
    sum += weight * v * (v > 0 ? step_inner : step_outer);
  }
  return sum;
}

FarField far_field(const FarSource& from, double least, std::uint64_t surface_voxels) {
  FarField far;
  for (int spacing = kLeastSpacing_vx; spacing <= kMostSpacing_vx; ++spacing) {
    far = plan_far(from, spacing);
    if (static_cast<double>(node_count(far)) <= kFarNodes * static_cast<double>(surface_voxels)) break;
  }
  sample_nodes(from, far);
  certify_far(from, least, far);
  return far;
}

}  // namespace vps::bake
