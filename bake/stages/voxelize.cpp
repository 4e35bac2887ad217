// SPDX-License-Identifier: GPL-3.0-or-later
// Surface voxelization by the Separating Axis Theorem. Paper: Sec. 2.1.1.
#include "bake/stages/voxelize.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
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

// The cubes whose centres are so near to a triangle's plane that they may touch it. The others certainly fail the exact
// test.
class PlaneSlab {
 public:
  PlaneSlab(const Surface& surface, std::size_t t, double edge, double slack)
      : edge_(edge), normal_(surface.normals[t]), corner_(surface.corner(t, 0)) {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, (surface.corner(t, k) - surface.corner(t, (k + 1) % 3)).squaredNorm());
    // The normal of a sliver is too inexact.
    constexpr double kSliver = 1e-4;
    const bool sliver = !(surface.area_normal(t).norm() > kSliver * longest);
    reach_ = sliver ? std::numeric_limits<double>::infinity() : (0.5 * normal_.lpNorm<1>() + 1e-3) * edge + 8 * slack;
  }

  /// @param first  centre of a row's first cube
  /// @return the first cube in the slab, and the end of these
  [[nodiscard]] std::array<std::uint32_t, 2> in_row(const Vector& first, std::uint32_t count) const {
    const double height = normal_.dot(first - corner_);
    const double rise = normal_.x() * edge_;
    if (std::abs(rise) < 1e-9 * edge_) return {0, std::abs(height) <= reach_ ? count : 0};
    const double at[2] = {(-reach_ - height) / rise, (reach_ - height) / rise};
    const auto clamped = [&](double i) {
      return static_cast<std::uint32_t>(std::clamp(i, 0.0, static_cast<double>(count)));
    };
    return {clamped(std::ceil(std::min(at[0], at[1]))), clamped(std::floor(std::max(at[0], at[1])) + 1)};
  }

 private:
  double edge_;
  Vector normal_, corner_;
  double reach_;
};

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
  // Threads may write to one byte, or one word of a mask, at the same time. Their order changes nothing.
  tbb::parallel_for(std::size_t{0}, surface.triangles.size(), [&](std::size_t t) {
    VoxelRange box[3];
    triangle_box(surface, grid, t, slack, box);
    for_each_brick(grid, box, [&](std::size_t at, const Index3& b, const Index3&, const Index3&) {
      const std::atomic_ref<std::uint8_t> flag(touched[at]);
      if (flag.load(std::memory_order_relaxed) != 0) return;
      const Vector centre = grid.origin + s * kBrickEdge * Vector(b[0] + 0.5, b[1] + 0.5, b[2] + 0.5);
      if (triangle_touches_cube(centre, s * kBrickEdge / 2, surface.corner(t, 0), surface.corner(t, 1),
                                surface.corner(t, 2), slack + 1e-9 * s)) {
        flag.store(1, std::memory_order_relaxed);
      }
    });
  });

  SurfaceVoxels voxels;
  voxels.set = BrickSet::from_flags(grid, touched);
  voxels.masks.assign(voxels.set.bricks.size(), BrickMask{});
  tbb::parallel_for(std::size_t{0}, surface.triangles.size(), [&](std::size_t t) {
    VoxelRange box[3];
    triangle_box(surface, grid, t, slack, box);
    const PlaneSlab slab(surface, t, s, slack);
    for_each_brick(grid, box, [&](std::size_t at, const Index3&, const Index3& lo, const Index3& hi) {
      const std::uint32_t brick = voxels.set.index[at];
      if (brick == kNoBrick) return;
      for (std::uint32_t k = lo[2]; k <= hi[2]; ++k) {
        const std::atomic_ref<std::uint64_t> word(voxels.masks[brick][k % kBrickEdge]);
        for (std::uint32_t j = lo[1]; j <= hi[1]; ++j) {
          const Vector first = grid.centre(lo[0], j, k);
          const auto [begin, end] = slab.in_row(first, hi[0] - lo[0] + 1);
          for (std::uint32_t i = lo[0] + begin; i < lo[0] + end; ++i) {
            const std::uint64_t bit = std::uint64_t{1} << voxel_in_brick(i, j, k) % 64;
            if ((word.load(std::memory_order_relaxed) & bit) != 0) continue;
            if (triangle_touches_cube(grid.centre(i, j, k), s / 2, surface.corner(t, 0), surface.corner(t, 1),
                                      surface.corner(t, 2), slack)) {
              word.fetch_or(bit, std::memory_order_relaxed);
            }
          }
        }
      }
    });
  });
  for (const BrickMask& mask : voxels.masks) {
    for (const std::uint64_t word : mask) voxels.count += static_cast<std::uint64_t>(std::popcount(word));
  }
  return voxels;
}

}  // namespace vps::bake
