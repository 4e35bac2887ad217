// SPDX-License-Identifier: GPL-3.0-or-later
// Surface voxelization by the Separating Axis Theorem. Paper: Sec. 2.1.1.
#include "bake/stages/voxelize.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps::bake {
namespace {

// Calls visit(brick position, first voxel, last voxel) for each brick that the voxel box overlaps.
template <class Visit>
void for_each_brick(const Grid& grid, const VoxelRange (&box)[3], Visit visit) {
  const auto lo = [&](int axis, std::uint32_t brick) { return std::max(box[axis].first, brick * kBrickEdge); };
  const auto hi = [&](int axis, std::uint32_t brick) {
    return std::min(box[axis].last, brick * kBrickEdge + kBrickEdge - 1);
  };
  for (std::uint32_t z = box[2].first / kBrickEdge; z <= box[2].last / kBrickEdge; ++z) {
    for (std::uint32_t y = box[1].first / kBrickEdge; y <= box[1].last / kBrickEdge; ++y) {
      for (std::uint32_t x = box[0].first / kBrickEdge; x <= box[0].last / kBrickEdge; ++x) {
        visit(grid.brick_at(x, y, z), Index3{x, y, z}, Index3{lo(0, x), lo(1, y), lo(2, z)},
              Index3{hi(0, x), hi(1, y), hi(2, z)});
      }
    }
  }
}

void triangle_box(const Surface& surface, const Grid& grid, std::size_t t, double slack, VoxelRange (&box)[3]) {
  const Vector low = surface.corner(t, 0).cwiseMin(surface.corner(t, 1)).cwiseMin(surface.corner(t, 2));
  const Vector high = surface.corner(t, 0).cwiseMax(surface.corner(t, 1)).cwiseMax(surface.corner(t, 2));
  for (int axis = 0; axis < 3; ++axis) box[axis] = voxel_range(grid, axis, low[axis], high[axis], slack);
}

}  // namespace

double rounding_slack(const Grid& grid) {
  double largest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double end = grid.origin[axis] + grid.dims[static_cast<std::size_t>(axis)] * grid.voxel_size;
    largest = std::max({largest, std::abs(grid.origin[axis]), std::abs(end)});
  }
  return 16 * std::numeric_limits<double>::epsilon() * largest;
}

VoxelRange voxel_range(const Grid& grid, int axis, double low, double high, double slack) {
  const double first = std::ceil((low - slack - grid.origin[axis]) / grid.voxel_size - 1 - 1e-9);
  const double last = std::floor((high + slack - grid.origin[axis]) / grid.voxel_size + 1e-9);
  const double limit = grid.dims[static_cast<std::size_t>(axis)] - 1.0;
  return {static_cast<std::uint32_t>(std::clamp(first, 0.0, limit)),
          static_cast<std::uint32_t>(std::clamp(last, 0.0, limit))};
}

bool triangle_touches_cube(const Vector& centre, double half_edge, const Vector& a, const Vector& b, const Vector& c,
                           double slack) {
  const double h = half_edge + slack;
  const Vector v[3] = {a - centre, b - centre, c - centre};
  for (int axis = 0; axis < 3; ++axis) {
    if (std::min({v[0][axis], v[1][axis], v[2][axis]}) > h) return false;
    if (std::max({v[0][axis], v[1][axis], v[2][axis]}) < -h) return false;
  }
  const Vector edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  // Relative part of the slack for axes that are products of two differences.
  const double relative = 32 * std::numeric_limits<double>::epsilon();
  const Vector normal = edges[0].cross(edges[1]);
  const double size = std::max({v[0].cwiseAbs().maxCoeff(), v[1].cwiseAbs().maxCoeff(), v[2].cwiseAbs().maxCoeff()});
  const double edge_size = std::max(edges[0].cwiseAbs().maxCoeff(), edges[1].cwiseAbs().maxCoeff());
  if (std::abs(normal.dot(v[0])) > h * normal.cwiseAbs().sum() + relative * edge_size * edge_size * (size + h) * 8) {
    return false;
  }
  for (const Vector& edge : edges) {
    for (int axis = 0; axis < 3; ++axis) {
      // unit(axis) x edge, written out.
      const int y = (axis + 1) % 3;
      const int z = (axis + 2) % 3;
      const double p0 = edge[y] * v[0][z] - edge[z] * v[0][y];
      const double p1 = edge[y] * v[1][z] - edge[z] * v[1][y];
      const double p2 = edge[y] * v[2][z] - edge[z] * v[2][y];
      const double spread = std::abs(edge[y]) + std::abs(edge[z]);
      const double radius = h * spread + relative * spread * (size + h);
      if (std::min({p0, p1, p2}) > radius || std::max({p0, p1, p2}) < -radius) return false;
    }
  }
  return true;
}

SurfaceVoxels voxelize(const Surface& surface, const Grid& grid) {
  const double slack = rounding_slack(grid);
  const double s = grid.voxel_size;
  std::vector<std::uint8_t> touched(grid.brick_count(), 0);
  VoxelRange box[3];
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    triangle_box(surface, grid, t, slack, box);
    for_each_brick(grid, box, [&](std::size_t at, const Index3& b, const Index3&, const Index3&) {
      if (touched[at] != 0) return;
      const Vector centre = grid.origin + s * kBrickEdge * Vector(b[0] + 0.5, b[1] + 0.5, b[2] + 0.5);
      touched[at] = triangle_touches_cube(centre, s * kBrickEdge / 2, surface.corner(t, 0), surface.corner(t, 1),
                                          surface.corner(t, 2), slack + 1e-9 * s);
    });
  }

  SurfaceVoxels voxels;
  voxels.set = BrickSet::from_flags(grid, touched);
  voxels.masks.assign(voxels.set.bricks.size(), BrickMask{});
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    triangle_box(surface, grid, t, slack, box);
    for_each_brick(grid, box, [&](std::size_t at, const Index3&, const Index3& lo, const Index3& hi) {
      const std::uint32_t brick = voxels.set.index[at];
      if (brick == kNoBrick) return;
      for (std::uint32_t k = lo[2]; k <= hi[2]; ++k) {
        for (std::uint32_t j = lo[1]; j <= hi[1]; ++j) {
          for (std::uint32_t i = lo[0]; i <= hi[0]; ++i) {
            const std::uint32_t voxel = voxel_in_brick(i, j, k);
            if (test_bit(voxels.masks[brick], voxel)) continue;
            if (triangle_touches_cube(grid.centre(i, j, k), s / 2, surface.corner(t, 0), surface.corner(t, 1),
                                      surface.corner(t, 2), slack)) {
              set_bit(voxels.masks[brick], voxel);
              ++voxels.count;
            }
          }
        }
      }
    });
  }
  return voxels;
}

}  // namespace vps::bake
