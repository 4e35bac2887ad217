// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/sample_brick.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "bake/stages/fine_samples.h"
#include "bake/stages/nearest_triangle.h"

namespace vps::bake {
namespace {

constexpr int kEdge = FieldBrick::kEdge;
constexpr int kCells = FieldBrick::kCells;

constexpr int sample_at(int x, int y, int z) {
  return FieldBrick::sample_at(x, y, z);
}
constexpr std::int32_t step_of(int level) {
  return FieldBrick::step_of(level);
}

}  // namespace

Index FieldBrick::octant_base(int octant) const {
  const std::int32_t half = step_of(level) * kCells / 2;
  return {base[0] + (octant & 1) * half, base[1] + (octant >> 1 & 1) * half, base[2] + (octant >> 2) * half};
}

BrickSampler::BrickSampler(const FieldSource& from)
    : surface_(from.surface),
      grid_(from.grid),
      runs_(from.runs),
      field_(from.field),
      inside_(from.inside),
      tolerance_(from.tolerance),
      octant_(from.grid, from.runs, from.field),
      reach_(std::max(from.field.band_inner, from.field.band_outer) - kHalfDiagonal * from.grid.voxel_size) {}

bool BrickSampler::load(const std::uint32_t (&at)[3]) {
  bool near = false;
  for (std::uint32_t corner = 0; corner < 8 && !near; ++corner) {
    const std::uint32_t b[3] = {at[0] + (corner & 1), at[1] + (corner >> 1 & 1), at[2] + (corner >> 2)};
    near = b[0] < grid_.brick_dims[0] && b[1] < grid_.brick_dims[1] && b[2] < grid_.brick_dims[2] &&
           field_.set.index[grid_.brick_at(b[0], b[1], b[2])] != kNoBrick;
  }
  if (!near) return false;
  octant_.load({at[0], at[1], at[2]});
  if (!any_in_band()) return false;
  octant_.estimate();
  for (std::size_t n = 0; n < fitted_.size(); ++n) fitted_[n] = fitted(octant_.value(n), octant_.shift(n));
  for (std::size_t axis = 0; axis < 3; ++axis)
    octant_base_[axis] = static_cast<std::int32_t>(at[axis] * kBrickEdge) * kQuarters;
  listed_ = {};
  float_listed_.clear();
  proof_listed_.clear();
  near_bricks_ = {};
  return true;
}

bool BrickSampler::is_inside(const std::uint32_t (&at)[3]) const {
  const std::uint32_t i[3] = {at[0] * kBrickEdge, at[1] * kBrickEdge, at[2] * kBrickEdge};
  if (i[0] >= grid_.dims[0] || i[1] >= grid_.dims[1] || i[2] >= grid_.dims[2]) return false;
  return field_.value(grid_, runs_, i[0], i[1], i[2]) > 0;
}

bool BrickSampler::any_in_band() const {
  for (std::size_t n = 0; n < OctantSamples::number(0, 0, OctantSamples::kSide); ++n) {
    if (octant_.value(n) <= tolerance_.band_inner && octant_.value(n) >= -tolerance_.band_outer) return true;
  }
  return false;
}

// The octant's sample at which a brick of level 0 or above begins.
std::array<int, 3> BrickSampler::place_in_octant(const FieldBrick& brick) const {
  std::array<int, 3> first;
  for (std::size_t axis = 0; axis < 3; ++axis) first[axis] = (brick.base[axis] - octant_base_[axis]) / kQuarters;
  return first;
}

double BrickSampler::fitted(double value, double shift_vx) const {
  const double shifted = value + std::clamp(shift_vx * grid_.voxel_size, -tolerance_.error, tolerance_.error);
  // A sample keeps its sign.
  return shifted * value > 0 ? shifted : value;
}

void BrickSampler::load_voxels(int level, const Index& base, FieldBrick& brick) const {
  brick.level = level;
  brick.base = base;
  const int step = level > 0 ? 2 : 1;
  const std::array<int, 3> first = place_in_octant(brick);
  std::size_t to = 0;
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x, ++to) {
        const std::size_t n = OctantSamples::number(first[0] + x * step, first[1] + y * step, first[2] + z * step);
        brick.value[to] = octant_.value(n);
        brick.closest[to] = octant_.closest(n);
        brick.fitted[to] = fitted_[n];
      }
    }
  }
  if (level == 0) return;
  const std::array<float, FieldBrick::kSamples> shifts = octant_.shifts_of_two();
  for (std::size_t n = 0; n < shifts.size(); ++n) brick.fitted[n] = fitted(brick.value[n], shifts[n]);
}

void BrickSampler::list_triangles() {
  constexpr std::int32_t kSpan = static_cast<std::int32_t>(kBrickEdge) * kQuarters;
  const std::uint32_t n = field_.set.index[grid_.brick_at(static_cast<std::uint32_t>(octant_base_[0] / kSpan),
                                                          static_cast<std::uint32_t>(octant_base_[1] / kSpan),
                                                          static_cast<std::uint32_t>(octant_base_[2] / kSpan))];
  near_bricks_ = {};
  if (n == kNoBrick) return;
  listed_ =
      std::span(field_.near_triangles).subspan(field_.near_start[n], field_.near_start[n + 1] - field_.near_start[n]);
  const Vector centre = place(octant_base_) + Vector::Constant(grid_.voxel_size * kBrickEdge / 2);
  for (const std::uint32_t t : listed_) {
    float_listed_.push_back(float_triangle(surface_, t, centre, grid_.voxel_size, kBrickEdge / 2.0));
    if (tolerance_.prove)
      proof_listed_.push_back(proof_triangle(float_listed_.back(), surface_, t, centre, grid_.voxel_size));
  }
  std::vector<std::uint32_t> all(listed_.size());
  std::iota(all.begin(), all.end(), 0U);
  near_bricks_ = near_octants(octant_base_, kQuarters * static_cast<std::int32_t>(kBrickEdge), all);
}

NearList BrickSampler::near(const FieldBrick& brick) {
  int octant = 0;
  for (int axis = 0; axis < 3; ++axis)
    octant |= place_in_octant(brick)[static_cast<std::size_t>(axis)] / kCells << axis;
  return near_octant(octant);
}

// Keeps the triangles whose distance to an octant's centre is at most the least one and the octant's diameter.
// @param edge  of the cube above `base`, in quarters
NearTriangles BrickSampler::near_octants(const Index& base, std::int32_t edge,
                                         std::span<const std::uint32_t> from) const {
  const double half = static_cast<double>(edge) / kQuarters / 2;
  const Vector low = from_centre(base);
  Places16 centres;
  for (std::size_t octant = 0; octant < 8; ++octant) {
    centres.x[octant] = static_cast<float>(low.x() + half * ((octant & 1) != 0 ? 1.5 : 0.5));
    centres.y[octant] = static_cast<float>(low.y() + half * ((octant & 2) != 0 ? 1.5 : 0.5));
    centres.z[octant] = static_cast<float>(low.z() + half * ((octant & 4) != 0 ? 1.5 : 0.5));
  }
  UnsetVector<std::array<float, 16>> distances(from.size());
  triangle_distances(float_listed_, from, centres, distances);
  const float farther = tolerance_.prove ? kSheetThickness + 0.01F : 0;
  std::array<float, 8> least;
  least.fill(std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const float error = float_listed_[from[i]].error;
    for (std::size_t octant = 0; octant < 8; ++octant) {
      least[octant] = std::min(least[octant], distances[i][octant] + error);
      distances[i][octant] -= error;
    }
  }
  NearTriangles near;
  near.positions.resize(8 * from.size());
  std::vector<std::uint32_t> farther_ones(from.size());
  std::uint32_t* end = near.positions.data();
  for (std::size_t octant = 0; octant < 8; ++octant) {
    // The factor is for rounding.
    const float limit = (least[octant] + static_cast<float>(2 * kHalfDiagonal * half)) * (1 + 1e-5F);
    std::size_t closest = 0, others = 0;
    for (std::size_t i = 0; i < from.size(); ++i) {
      const float distance = distances[i][octant];
      end[closest] = farther_ones[others] = from[i];
      closest += distance <= limit ? 1 : 0;
      others += distance > limit && distance <= limit + farther ? 1 : 0;
    }
    end = std::copy_n(farther_ones.begin(), others, end + closest);
    near.closest[octant] = static_cast<std::uint32_t>(closest);
    near.start[octant + 1] = static_cast<std::uint32_t>(end - near.positions.data());
  }
  near.positions.resize(near.start[8]);
  return near;
}

Places128 BrickSampler::float_places(const Index& base, int level) const {
  static constexpr auto kSteps = [] {
    std::array<std::array<float, 128>, 3> steps{};
    for (int n = 0; n < FieldBrick::kSamples; ++n) {
      const int at[3] = {n % kEdge, n / kEdge % kEdge, n / (kEdge * kEdge)};
      for (std::size_t axis = 0; axis < 3; ++axis)
        steps[axis][static_cast<std::size_t>(n)] = static_cast<float>(at[axis]);
    }
    return steps;
  }();
  const float step = static_cast<float>(step_of(level)) / kQuarters;
  const Vector first = from_centre(base);
  Places128 places;
  for (std::size_t n = 0; n < places.x.size(); ++n) {
    places.x[n] = static_cast<float>(first.x()) + step * kSteps[0][n];
    places.y[n] = static_cast<float>(first.y()) + step * kSteps[1][n];
    places.z[n] = static_cast<float>(first.z()) + step * kSteps[2][n];
  }
  return places;
}

void BrickSampler::load_between(const FieldBrick& parent, int octant, std::span<const std::uint32_t> from,
                                FieldBrick& brick) const {
  brick.level = parent.level - 1;
  brick.base = parent.octant_base(octant);
  const PointLattice points = lattice(brick.base, brick.level);
  std::vector<PlaceBits> bits(from.size());
  const auto slack = static_cast<float>(kEquallyNear * points.step / grid_.voxel_size);
  find_where_nearest(float_listed_, from, float_places(brick.base, brick.level), slack, bits);
  std::vector<std::uint32_t> triangles(from.size());
  std::transform(from.begin(), from.end(), triangles.begin(), [&](std::uint32_t n) { return listed_[n]; });
  NearestToSamples nearest;
  nearest.squared.fill(reach_ * reach_);
  nearest.triangle.fill(-1);
  offer_triangles(surface_, triangles, bits, points, reach_, nearest);
  std::array<double, 27> known;
  for (int n = 0; n < 27; ++n) {
    known[static_cast<std::size_t>(n)] = parent.value[static_cast<std::size_t>(FieldBrick::in_octant(octant, n))];
  }
  std::array<double, FieldBrick::kSamples> surest;
  fill_between<3>(
      known, [](double a, double b) { return std::abs(b) > std::abs(a) ? b : a; }, surest);
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const auto at = static_cast<std::size_t>(sample_at(x, y, z));
        const int odd = (x & 1) + (y & 1) + (z & 1);
        if (odd == 0) {
          const int n = (z / 2 * 3 + y / 2) * 3 + x / 2;
          brick.value[at] = known[static_cast<std::size_t>(n)];
          brick.closest[at] = parent.closest[static_cast<std::size_t>(FieldBrick::in_octant(octant, n))];
          continue;
        }
        const Vector p = points.at(x, y, z);
        const double found = nearest.triangle[at];
        double distance = reach_;
        brick.closest[at] = kNoTriangle;
        if (found >= 0) {
          const auto t = static_cast<std::uint32_t>(found);
          const Vector near =
              closest_on_triangle(p, surface_.corner(t, 0), surface_.corner(t, 1), surface_.corner(t, 2));
          distance = std::min((near - p).norm(), reach_);
          brick.closest[at] = t;
        }
        // The surface cannot pass between two points if their distance is less than the sum of their distances to it.
        const bool known_side = distance + std::abs(surest[at]) > points.step * std::sqrt(odd) * (1 + 1e-9);
        const bool within = known_side ? surest[at] > 0 : inside_.inside(p);
        brick.value[at] = within ? distance : -distance;
      }
    }
  }
  // Not fitted: shifts would need a neighbour's samples, which are not known.
  brick.fitted = brick.value;
}

bool BrickSampler::surely_interpolates(const FieldBrick& parent, int octant, std::span<const std::uint32_t> from,
                                       double noted) const {
  const double per_voxel = 1 / grid_.voxel_size;
  const Index base = parent.octant_base(octant);
  const PointLattice points = lattice(base, parent.level - 1);
  OctantTrial trial;
  for (int n = 0; n < 27; ++n) {
    const auto at = static_cast<std::size_t>(FieldBrick::in_octant(octant, n));
    trial.value[static_cast<std::size_t>(n)] = static_cast<float>(parent.value[at] * per_voxel);
    trial.fitted[static_cast<std::size_t>(n)] = static_cast<float>(parent.fitted[at] * per_voxel);
  }
  trial.reach = static_cast<float>(reach_ * per_voxel);
  trial.step = static_cast<float>(step_of(parent.level - 1)) / kQuarters;
  nearest_distances(float_listed_, from, float_places(base, parent.level - 1), trial.distance);
  for (const std::uint32_t n : from) trial.error = std::max(trial.error, float_listed_[n].error);
  return bake::surely_interpolates(
      trial, {tolerance_.error * per_voxel, tolerance_.band_inner * per_voxel, tolerance_.band_outer * per_voxel},
      noted * per_voxel, [&](std::size_t sample) {
        const auto n = static_cast<int>(sample);
        return inside_.inside(points.at(n % kEdge, n / kEdge % kEdge, n / (kEdge * kEdge)));
      });
}

double BrickSampler::bound(const FieldBrick& brick, int octant, std::span<const std::uint32_t> from,
                           double enough) const {
  const double s = grid_.voxel_size;
  const CellLimits limits{static_cast<float>(tolerance_.band_inner / s - kHalfDiagonal),
                          static_cast<float>(tolerance_.band_outer / s - kHalfDiagonal),
                          static_cast<float>(enough / s)};
  // `scaled` may clamp values beyond the band, those of level 1 beyond twice the band.
  const double clamp = std::max(tolerance_.band_inner, tolerance_.band_outer) * (brick.level > 0 ? 2 : 1);
  CellCube cube;
  double nearest = std::numeric_limits<double>::infinity();
  double shift = 0;
  for (std::size_t n = 0; n < cube.most_stored.size(); ++n) {
    const auto at = static_cast<std::size_t>(FieldBrick::in_octant(octant, static_cast<int>(n)));
    cube.most_stored[n] = static_cast<float>(-brick.fitted[at] / s);
    cube.least_stored[n] = static_cast<float>(-std::clamp(brick.fitted[at], -clamp, clamp) / s);
    cube.exact[n] = static_cast<float>(-brick.value[at] / s);
    nearest = std::min(nearest, std::abs(brick.value[at]) / s);
    shift = std::max(shift, std::abs(brick.fitted[at] - brick.value[at]) / s);
  }
  cube.low = from_centre(brick.octant_base(octant));
  cube.edge = static_cast<float>(step_of(brick.level)) / kQuarters;
  // No point is farther than this from a sample.
  const double half = kHalfDiagonal * static_cast<double>(cube.edge);
  if (nearest - half > std::max(tolerance_.band_inner, tolerance_.band_outer) / s - kHalfDiagonal) {
    return std::max(shift - half, 0.0) * s;
  }
  const float proven = CellBounds(proof_listed_, limits).bound(cube, from);
  if (proven > limits.enough) return std::numeric_limits<double>::infinity();
  return std::max(static_cast<double>(proven), shift) * s;
}

BrickErrors BrickSampler::errors(const FieldBrick& brick) const {
  const auto part_of = [](const CellErrors& cells, const std::array<int, 3>& first) {
    BrickErrors part;
    for (int z = 0; z < kCells; ++z) {
      for (int y = 0; y < kCells; ++y) {
        const auto* const from = &cells[OctantSamples::cell(first[0], first[1] + y, first[2] + z)];
        std::copy_n(from, kCells, &part.cells[static_cast<std::size_t>(BrickErrors::number(0, y, z))]);
      }
    }
    return part;
  };
  if (brick.level == 0) return part_of(octant_.errors(), place_in_octant(brick));
  ChordLines lines;
  constexpr int kHalo = ChordLines::kHalo;
  std::fill_n(&lines.value[0][0][0], sizeof(lines.value) / sizeof(float), std::numeric_limits<float>::quiet_NaN());
  for (int z = 0; z < kEdge; ++z) {
    for (int y = 0; y < kEdge; ++y) {
      for (int x = 0; x < kEdge; ++x) {
        const auto v = static_cast<float>(brick.value[static_cast<std::size_t>(sample_at(x, y, z))] / grid_.voxel_size);
        lines.value[0][kHalo + x][z * ChordLines::kSide + y] = v;
        lines.value[1][kHalo + y][z * ChordLines::kSide + x] = v;
        lines.value[2][kHalo + z][y * ChordLines::kSide + x] = v;
      }
    }
  }
  chord_errors(lines);
  CellErrors cells;
  cell_errors(lines, cells);
  return part_of(cells, {0, 0, 0});
}

Vector BrickSampler::place(const FieldBrick& brick, std::size_t sample) const {
  const std::int32_t step = step_of(brick.level);
  const auto n = static_cast<int>(sample);
  return place({brick.base[0] + n % kEdge * step, brick.base[1] + n / kEdge % kEdge * step,
                brick.base[2] + n / (kEdge * kEdge) * step});
}

}  // namespace vps::bake
