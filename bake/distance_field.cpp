// SPDX-License-Identifier: GPL-3.0-or-later
// Narrow-band distances: every triangle offers its distance to the voxel centres near it; the nearest one wins.
#include "bake/distance_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps {
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

struct BrickResult {
  std::array<double, kBrickVoxels> squared;
  std::array<std::uint32_t, kBrickVoxels> closest;
};

void brick_distances(const Surface& surface, const Grid& grid, const Index3& brick, const std::uint32_t* first,
                     const std::uint32_t* last, double band, BrickResult& out) {
  out.squared.fill(std::numeric_limits<double>::infinity());
  out.closest.fill(kNoTriangle);
  const double s = grid.voxel_size;
  const Vector corner = grid.origin + s * kBrickEdge * Vector(brick[0], brick[1], brick[2]);
  for (const std::uint32_t* it = first; it != last; ++it) {
    const Vector& a = surface.corner(*it, 0);
    const Vector& b = surface.corner(*it, 1);
    const Vector& c = surface.corner(*it, 2);
    const Vector low = ((a.cwiseMin(b).cwiseMin(c) - corner).array() - band) / s - 0.5;
    const Vector high = ((a.cwiseMax(b).cwiseMax(c) - corner).array() + band) / s - 0.5;
    int from[3];
    int to[3];
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = std::max(0, static_cast<int>(std::ceil(std::max(low[axis], -1.0))));
      to[axis] = std::min(static_cast<int>(kBrickEdge) - 1, static_cast<int>(std::floor(std::min(high[axis], 8.0))));
    }
    const Vector& normal = surface.normals[*it];
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        for (int x = from[0]; x <= to[0]; ++x) {
          const Vector p = corner + s * Vector(x + 0.5, y + 0.5, z + 0.5);
          const auto voxel = static_cast<std::size_t>((z * 8 + y) * 8 + x);
          const double limit = std::min(out.squared[voxel], band * band * (1 + 1e-12));
          const double plane = normal.dot(p - a);
          if (plane * plane * (1 - 1e-9) > limit) continue;
          const double squared = (closest_on_triangle(p, a, b, c) - p).squaredNorm();
          // Strictly nearer: among equals the first triangle wins, whatever the order of work.
          if (squared < out.squared[voxel] && squared <= band * band) {
            out.squared[voxel] = squared;
            out.closest[voxel] = *it;
          }
        }
      }
    }
  }
}

}  // namespace

double BandField::value(const Grid& grid, const InsideRuns& runs, std::uint32_t i, std::uint32_t j,
                        std::uint32_t k) const {
  const std::uint32_t brick = set.index[grid.brick_of_voxel(i, j, k)];
  if (brick != kNoBrick) return penetration[at(brick, voxel_in_brick(i, j, k))];
  return runs.test(grid, i, j, k) ? band : -band;
}

BandField distance_field(const Surface& surface, const Grid& grid, const InsideRuns& runs, double band) {
  const BrickTriangles lists = gather(surface, grid, band);
  const std::size_t candidates = lists.set.bricks.size();
  std::vector<BrickResult> results(candidates);
  std::vector<std::uint8_t> holds_band(candidates, 0);
  tbb::parallel_for(std::size_t{0}, candidates, [&](std::size_t n) {
    const std::uint32_t* const first = lists.triangles.data() + lists.start[n];
    const std::uint32_t* const last = lists.triangles.data() + lists.start[n + 1];
    brick_distances(surface, grid, lists.set.bricks[n], first, last, band, results[n]);
    holds_band[n] = std::any_of(results[n].closest.begin(), results[n].closest.end(),
                                [](std::uint32_t t) { return t != kNoTriangle; });
  });

  std::vector<std::uint8_t> chosen(grid.brick_count(), 0);
  for (std::size_t n = 0; n < candidates; ++n) {
    const Index3& b = lists.set.bricks[n];
    chosen[grid.brick_at(b[0], b[1], b[2])] = holds_band[n];
  }
  BandField field;
  field.band = band;
  field.set = BrickSet::from_flags(grid, chosen);
  field.inside = inside_masks(runs, grid, field.set);
  field.penetration.resize(field.set.bricks.size() * kBrickVoxels);
  field.closest.resize(field.penetration.size());
  for (std::size_t n = 0; n < candidates; ++n) {
    const Index3& b = lists.set.bricks[n];
    const std::uint32_t brick = field.set.index[grid.brick_at(b[0], b[1], b[2])];
    if (brick == kNoBrick) continue;
    for (std::uint32_t voxel = 0; voxel < kBrickVoxels; ++voxel) {
      const std::size_t at = field.at(brick, voxel);
      field.closest[at] = results[n].closest[voxel];
      const double distance = field.closest[at] == kNoTriangle ? band : std::sqrt(results[n].squared[voxel]);
      field.penetration[at] = test_bit(field.inside[brick], voxel) ? distance : -distance;
    }
  }
  return field;
}

Vector exact_gradient(const Surface& surface, const Grid& grid, const BandField& field, std::size_t brick,
                      std::uint32_t voxel) {
  const std::size_t at = field.at(brick, voxel);
  const std::uint32_t t = field.closest[at];
  if (t == kNoTriangle) return Vector::Zero();
  const Vector p = grid.centre(field.set.bricks[brick], voxel);
  const Vector to_surface =
      closest_on_triangle(p, surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2)) - p;
  const double distance = to_surface.norm();
  // On the surface the direction to it is lost; the triangle's inward normal is its limit.
  if (distance < 1e-9 * grid.voxel_size) return -surface.normals[t];
  return to_surface * ((test_bit(field.inside[brick], voxel) ? -1.0 : 1.0) / distance);
}

std::vector<std::int16_t> coarse_layers(const ClosestPoint& closest, const Grid& grid, const InsideRuns& runs,
                                        const BandField& field) {
  std::vector<std::int16_t> layers(grid.brick_count(), 0);
  tbb::parallel_for(std::uint32_t{0}, grid.brick_dims[2], [&](std::uint32_t z) {
    for (std::uint32_t y = 0; y < grid.brick_dims[1]; ++y) {
      for (std::uint32_t x = 0; x < grid.brick_dims[0]; ++x) {
        const std::size_t at = grid.brick_at(x, y, z);
        if (field.set.index[at] != kNoBrick) continue;
        const Vector centre = grid.origin + grid.voxel_size * kBrickEdge * Vector(x + 0.5, y + 0.5, z + 0.5);
        // The least rounding of the distance must not round the bound up.
        const double voxels = std::floor(closest.distance(centre) / grid.voxel_size * (1 - 1e-9));
        const auto layer = static_cast<std::int16_t>(std::clamp(voxels, 1.0, 32767.0));
        // The brick holds no surface: any of its voxels tells the side.
        layers[at] = runs.test(grid, x * 8 + 4, y * 8 + 4, z * 8 + 4) ? layer : static_cast<std::int16_t>(-layer);
      }
    }
  });
  return layers;
}

}  // namespace vps
