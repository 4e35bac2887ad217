// SPDX-License-Identifier: GPL-3.0-or-later
// Narrow-band distances: every triangle offers its distance to the voxel centres near it; the nearest one wins.
#include "bake/stages/distance_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
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

// The lists are sorted only where one thread makes them.
BrickTriangles gather(const Surface& surface, const Grid& grid, double band) {
  // The bricks of some triangles that follow each other.
  struct Bricks {
    std::vector<std::uint32_t> of_triangle;  // how many
    std::vector<std::uint32_t> all;
  };
  const std::size_t count = surface.triangles.size();
  std::vector<Bricks> parts(std::min<std::size_t>(count, 1024));
  const auto first_of = [&](std::size_t part) { return part * count / parts.size(); };
  std::vector<std::uint32_t> counts(grid.brick_count(), 0);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    for (std::size_t t = first_of(n); t < first_of(n + 1); ++t) {
      const std::size_t before = parts[n].all.size();
      visit_bricks(surface, grid, t, band, [&](std::size_t brick) {
        parts[n].all.push_back(static_cast<std::uint32_t>(brick));
        std::atomic_ref(counts[brick]).fetch_add(1, std::memory_order_relaxed);
      });
      parts[n].of_triangle.push_back(static_cast<std::uint32_t>(parts[n].all.size() - before));
    }
  });
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
  std::vector<std::size_t> next(lists.start.begin(), lists.start.end() - 1);
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t n) {
    auto t = static_cast<std::uint32_t>(first_of(n));
    auto brick = parts[n].all.begin();
    for (const std::uint32_t bricks : parts[n].of_triangle) {
      for (const auto end = brick + bricks; brick != end; ++brick) {
        const std::atomic_ref place(next[lists.set.index[*brick]]);
        lists.triangles[place.fetch_add(1, std::memory_order_relaxed)] = t;
      }
      ++t;
    }
  });
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
  BrickTriangles lists = gather(surface, grid, band);
  const std::size_t candidates = lists.set.bricks.size();
  const std::vector<BrickMask> inside = inside_masks(runs, grid, lists.set);
  // The exact voxels of a brick.
  struct Result {
    BrickMask exact;
    std::array<std::uint16_t, kBrickEdge> plane;
    std::size_t count;
    std::size_t first;  // place in the field
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
    // In this order they are offered, whichever thread came first.
    if (!std::is_sorted(near.begin(), near.end())) std::sort(near.begin(), near.end());
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
  field.near_start.push_back(0);
  std::vector<std::uint8_t> chosen(grid.brick_count(), 0);
  // Works in parts, so that not all results are held twice.
  constexpr std::size_t kPart = 512;
  UnsetVector<Result> results(std::min(candidates, kPart));
  auto next_near = lists.triangles.begin();
  for (std::size_t first = 0; first < candidates; first += kPart) {
    const std::size_t end = std::min(first + kPart, candidates);
    tbb::parallel_for(first, end, [&](std::size_t n) { compute(n, results[n - first]); });
    std::size_t voxels = field.closest.size();
    for (std::size_t n = first; n < end; ++n) {
      Result& result = results[n - first];
      result.first = voxels;
      if (result.count == 0) continue;
      const Index3& b = lists.set.bricks[n];
      chosen[grid.brick_at(b[0], b[1], b[2])] = 1;
      field.inside.push_back(inside[n]);
      field.exact.push_back(result.exact);
      field.start.push_back({voxels, result.plane});
      voxels += result.count;
      const auto near = lists.triangles.begin() + static_cast<std::ptrdiff_t>(lists.start[n]);
      const auto near_end = lists.triangles.begin() + static_cast<std::ptrdiff_t>(lists.start[n + 1]);
      next_near = std::copy(near, near_end, next_near);
      field.near_start.push_back(static_cast<std::size_t>(next_near - lists.triangles.begin()));
    }
    field.penetration.resize(voxels);
    field.closest.resize(voxels);
    tbb::parallel_for(std::size_t{0}, end - first, [&](std::size_t n) {
      const Result& result = results[n];
      std::copy_n(result.penetration.data(), result.count, field.penetration.data() + result.first);
      std::copy_n(result.closest.data(), result.count, field.closest.data() + result.first);
    });
  }
  lists.triangles.erase(next_near, lists.triangles.end());
  field.near_triangles = std::move(lists.triangles);
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
