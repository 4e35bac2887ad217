// SPDX-License-Identifier: GPL-3.0-or-later
// Narrow-band distances: every triangle offers its distance to the voxel centres near it; the nearest one wins.
#include "bake/stages/distance_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/stages/nearest_triangle.h"

namespace vps::bake {
namespace {

// Triangles that may be within the band of a brick's voxel centres, brick after brick in scan order.
struct BrickTriangles {
  BrickSet set;
  std::vector<std::size_t> start;
  std::vector<std::uint32_t> triangles;
};

struct BrickRange {
  Index3 first, last;
};

BrickRange bricks_near(const Surface& surface, const Grid& grid, std::size_t t, double band) {
  BrickRange range{};
  const Vector low = surface.corner(t, 0).cwiseMin(surface.corner(t, 1)).cwiseMin(surface.corner(t, 2));
  const Vector high = surface.corner(t, 0).cwiseMax(surface.corner(t, 1)).cwiseMax(surface.corner(t, 2));
  for (int axis = 0; axis < 3; ++axis) {
    const VoxelRange voxels = voxel_range(grid, axis, low[axis], high[axis], band);
    range.first[static_cast<std::size_t>(axis)] = voxels.first / kBrickEdge;
    range.last[static_cast<std::size_t>(axis)] = voxels.last / kBrickEdge;
  }
  return range;
}

// Calls visit(position in the grid) for the bricks whose voxel centres may be within the band of triangle t.
template <class Visit>
void visit_bricks(const Surface& surface, const Grid& grid, std::size_t t, double band, Visit visit) {
  const BrickRange range = bricks_near(surface, grid, t, band);
  const double s = grid.voxel_size;
  const double reach = band + std::sqrt(3.0) * (kBrickEdge / 2.0) * s;
  // For a small triangle most bricks of the box pass: the test only pays for large ones.
  const bool large =
      range.last[0] - range.first[0] > 1 || range.last[1] - range.first[1] > 1 || range.last[2] - range.first[2] > 1;
  for (std::uint32_t z = range.first[2]; z <= range.last[2]; ++z) {
    for (std::uint32_t y = range.first[1]; y <= range.last[1]; ++y) {
      for (std::uint32_t x = range.first[0]; x <= range.last[0]; ++x) {
        if (large) {
          const Vector centre = grid.origin + s * kBrickEdge * Vector(x + 0.5, y + 0.5, z + 0.5);
          const Vector near =
              closest_on_triangle(centre, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2));
          if ((near - centre).squaredNorm() > reach * reach) continue;
        }
        visit(grid.brick_at(x, y, z));
      }
    }
  }
}

BrickTriangles gather(const Surface& surface, const Grid& grid, double band) {
  std::vector<std::uint32_t> counts(grid.brick_count(), 0);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    visit_bricks(surface, grid, t, band, [&](std::size_t brick) { ++counts[brick]; });
  }
  std::vector<std::uint8_t> chosen(grid.brick_count());
  std::transform(counts.begin(), counts.end(), chosen.begin(), [](std::uint32_t n) { return n > 0; });
  BrickTriangles lists;
  lists.set = BrickSet::from_flags(grid, chosen);
  lists.start.assign(lists.set.bricks.size() + 1, 0);
  for (std::size_t n = 0; n < lists.set.bricks.size(); ++n) {
    const Index3& b = lists.set.bricks[n];
    lists.start[n + 1] = lists.start[n] + counts[grid.brick_at(b[0], b[1], b[2])];
  }
  lists.triangles.resize(lists.start.back());
  std::vector<std::size_t> fill(lists.start.begin(), lists.start.end() - 1);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    visit_bricks(surface, grid, t, band, [&](std::size_t brick) {
      lists.triangles[fill[lists.set.index[brick]]++] = static_cast<std::uint32_t>(t);
    });
  }
  return lists;
}

}  // namespace

double BandField::value(const Grid& grid, const InsideRuns& runs, std::uint32_t i, std::uint32_t j,
                        std::uint32_t k) const {
  const std::uint32_t brick = set.index[grid.brick_of_voxel(i, j, k)];
  if (brick != kNoBrick) return value(brick, voxel_in_brick(i, j, k));
  return runs.test(grid, i, j, k) ? band_inner : -band_outer;
}

BandField distance_field(const Surface& surface, const Grid& grid, const InsideRuns& runs, double band_inner,
                         double band_outer) {
  const double band = std::max(band_inner, band_outer);
  const BrickTriangles lists = gather(surface, grid, band);
  const std::size_t candidates = lists.set.bricks.size();
  const std::vector<BrickMask> inside = inside_masks(runs, grid, lists.set);
  // The exact voxels of a brick.
  struct Result {
    BrickMask exact;
    std::array<std::uint16_t, kBrickEdge> plane;
    std::size_t count;
    std::array<double, kBrickVoxels> penetration;
    std::array<std::uint32_t, kBrickVoxels> closest;
  };
  const auto compute = [&](std::size_t n, Result& result) {
    // Triangles farther than the band are ignored; the slack is for rounding.
    NearestTriangles nearest;
    nearest.squared.fill(band * band * (1 + 1e-9));
    nearest.triangle.fill(-1);
    const PointLattice points{grid.centre(lists.set.bricks[n], 0), grid.voxel_size};
    const auto near = std::span(lists.triangles).subspan(lists.start[n], lists.start[n + 1] - lists.start[n]);
    offer_triangles(surface, near, points, band, nearest);
    result.exact = {};
    result.count = 0;
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
      if (voxel % 64 == 0) result.plane[voxel / 64] = static_cast<std::uint16_t>(result.count);
      if (nearest.triangle[voxel] < 0) continue;
      // The vectorized search found the triangle. Its distance is computed again, exact to the last digit.
      const auto t = static_cast<std::uint32_t>(nearest.triangle[voxel]);
      const Vector p = grid.centre(lists.set.bricks[n], voxel);
      const double distance =
          (closest_on_triangle(p, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)) - p).norm();
      const bool within = test_bit(inside[n], voxel);
      if (distance > (within ? band_inner : band_outer)) continue;
      set_bit(result.exact, voxel);
      result.penetration[result.count] = within ? distance : -distance;
      result.closest[result.count++] = t;
    }
  };

  BandField field;
  field.band_inner = band_inner;
  field.band_outer = band_outer;
  // Reserving room for all candidates only costs addresses: pages that are never written take no memory.
  field.inside.reserve(candidates);
  field.exact.reserve(candidates);
  field.start.reserve(candidates);
  field.penetration.reserve(candidates * kBrickVoxels);
  field.closest.reserve(candidates * kBrickVoxels);
  field.near_triangles.reserve(lists.triangles.size());
  field.near_start.push_back(0);
  std::vector<std::uint8_t> chosen(grid.brick_count(), 0);
  // Works in parts, so that not all results are held twice.
  constexpr std::size_t kPart = 256;
  std::vector<Result> results(std::min(candidates, kPart));
  for (std::size_t first = 0; first < candidates; first += kPart) {
    const std::size_t end = std::min(first + kPart, candidates);
    tbb::parallel_for(first, end, [&](std::size_t n) { compute(n, results[n - first]); });
    for (std::size_t n = first; n < end; ++n) {
      const Result& result = results[n - first];
      if (result.count == 0) continue;
      const Index3& b = lists.set.bricks[n];
      chosen[grid.brick_at(b[0], b[1], b[2])] = 1;
      field.inside.push_back(inside[n]);
      field.exact.push_back(result.exact);
      field.start.push_back({field.closest.size(), result.plane});
      const auto count = static_cast<std::ptrdiff_t>(result.count);
      field.penetration.insert(field.penetration.end(), result.penetration.begin(), result.penetration.begin() + count);
      field.closest.insert(field.closest.end(), result.closest.begin(), result.closest.begin() + count);
      field.near_triangles.insert(field.near_triangles.end(),
                                  lists.triangles.begin() + static_cast<std::ptrdiff_t>(lists.start[n]),
                                  lists.triangles.begin() + static_cast<std::ptrdiff_t>(lists.start[n + 1]));
      field.near_start.push_back(field.near_triangles.size());
    }
  }
  field.set = BrickSet::from_flags(grid, chosen);
  return field;
}

Vector exact_gradient(const Surface& surface, const Vector& point, std::uint32_t triangle, bool inside,
                      double voxel_size) {
  if (triangle == kNoTriangle) return Vector::Zero();
  const Vector to_surface = closest_on_triangle(point, surface.corner(triangle, 0), surface.corner(triangle, 1),
                                                surface.corner(triangle, 2)) -
                            point;
  const double distance = to_surface.norm();
  // On the surface the direction to it is undefined. The triangle's inward normal is its limit.
  if (distance < 1e-9 * voxel_size) return -surface.normals[triangle];
  return to_surface * ((inside ? -1.0 : 1.0) / distance);
}

}  // namespace vps::bake
