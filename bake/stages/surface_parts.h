// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The surface, cut at cells of 8x8x8 voxels. Internal to bake. Lengths are in voxels, from the centre of voxel
/// (0,0,0).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bake/geometry.h"
#include "bake/grid.h"
#include "formats/cell_plane.h"

namespace vps::bake {

/// The part of the surface in one cell: the corners of its flat pieces.
struct SurfacePart {
  std::vector<Vector> corners;
  Eigen::AlignedBox3d box;
};

/// The surface, cell by cell.
class SurfaceParts {
 public:
  /// How far around a cell or block its surface is given. [cells]
  static constexpr std::uint32_t kAround = 2;

  SurfaceParts(const Surface& surface, const Grid& grid);

  /// Calls visit(part) for those in cells up to `kAround` away from a block of cells.
  /// @param cell   the block's lowest
  /// @param cells  along the block's edge
  template <class Visit>
  void for_each_around(const Index3& cell, std::uint32_t cells, Visit visit) const {
    Index3 first;
    Index3 last;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      first[axis] = cell[axis] - std::min(cell[axis], kAround);
      last[axis] = std::min(cell[axis] + cells - 1 + kAround, dims_[axis] - 1);
    }
    for_each_cell(first, last, [&](std::size_t at) {
      const std::uint32_t n = set_.index[at];
      if (n != kNoBrick && !parts_[n].corners.empty()) visit(parts_[n]);
    });
  }

 private:
  [[nodiscard]] std::size_t number_of(const Index3& cell) const {
    return (std::size_t{cell[2]} * dims_[1] + cell[1]) * dims_[0] + cell[0];
  }
  template <class Visit>
  void for_each_cell(const Index3& first, const Index3& last, Visit visit) const {
    for (std::uint32_t z = first[2]; z <= last[2]; ++z) {
      for (std::uint32_t y = first[1]; y <= last[1]; ++y) {
        const std::size_t row = number_of({0, y, z});
        for (std::uint32_t x = first[0]; x <= last[0]; ++x) visit(row + x);
      }
    }
  }
  [[nodiscard]] Eigen::AlignedBox3d box_of(const Triangle& triangle) const;
  // Lists for each cell the triangles whose boxes touch it.
  void list_triangles();
  void cut(const Index3& cell, SurfacePart& part) const;

  const Surface& surface_;
  const Index3 dims_;
  std::vector<Vector> vertices_;
  std::vector<std::size_t> begin_;  // of each cell's triangles; one more than cells
  std::vector<std::uint32_t> triangles_;
  BrickSet set_;
  std::vector<SurfacePart> parts_;
};

}  // namespace vps::bake
