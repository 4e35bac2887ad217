// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/surface_parts.h"

#include <tbb/parallel_for.h>

#include <array>
#include <cmath>
#include <numeric>

namespace vps::bake {
namespace {

// A convex polygon, clipped by the planes of a box.
class Polygon {
 public:
  Polygon(const Vector& a, const Vector& b, const Vector& c) : corners_{a, b, c}, count_(3) {}

  void clip(const Eigen::AlignedBox3d& box) {
    for (int axis = 0; axis < 3 && count_ > 0; ++axis) {
      clip_at(axis, box.min()[axis], 1);
      clip_at(axis, box.max()[axis], -1);
    }
  }
  [[nodiscard]] const Vector* begin() const { return corners_.data(); }
  [[nodiscard]] const Vector* end() const { return corners_.data() + count_; }

 private:
  // Keeps what lies above the plane, or below it where `side` is -1.
  void clip_at(int axis, double at, double side) {
    std::array<Vector, 12> kept;
    std::size_t count = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Vector& p = corners_[i];
      const Vector& q = corners_[i + 1 < count_ ? i + 1 : 0];
      const double from = side * (p[axis] - at);
      const double to = side * (q[axis] - at);
      if (from >= 0) kept[count++] = p;
      if ((from < 0) != (to < 0)) kept[count++] = p + from / (from - to) * (q - p);
    }
    corners_ = kept;
    count_ = count;
  }

  std::array<Vector, 12> corners_;
  std::size_t count_;
};

}  // namespace

SurfaceParts::SurfaceParts(const Surface& surface, const Grid& grid) : surface_(surface), dims_(grid.brick_dims) {
  vertices_.reserve(surface.vertices.size());
  for (const Vector& p : surface.vertices) {
    vertices_.emplace_back((p - grid.origin) / grid.voxel_size - Vector::Constant(0.5));
  }
  list_triangles();
  std::vector<std::uint8_t> listed(grid.brick_count());
  for (std::size_t n = 0; n < listed.size(); ++n) listed[n] = begin_[n] < begin_[n + 1] ? 1 : 0;
  set_ = BrickSet::from_flags(grid, listed);
  parts_.resize(set_.bricks.size());
  tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t n) { cut(set_.bricks[n], parts_[n]); });
}

Eigen::AlignedBox3d SurfaceParts::box_of(const Triangle& triangle) const {
  Eigen::AlignedBox3d box;
  for (const std::uint32_t v : triangle) box.extend(vertices_[v]);
  return box;
}

void SurfaceParts::list_triangles() {
  const auto for_each_listed = [&](auto visit) {
    for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
      const Eigen::AlignedBox3d box = box_of(surface_.triangles[t]);
      Index3 first;
      Index3 last;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<Eigen::Index>(axis);
        const auto cell = [&](double at) {
          return static_cast<std::uint32_t>(std::clamp(at / kPlaneCell, 0.0, dims_[axis] - 1.0));
        };
        // Both cells at a face.
        first[axis] = cell(std::ceil(box.min()[i]) - 1);
        last[axis] = cell(box.max()[i]);
      }
      for_each_cell(first, last, [&](std::size_t at) { visit(at, t); });
    }
  };
  begin_.assign(std::size_t{dims_[0]} * dims_[1] * dims_[2] + 1, 0);
  for_each_listed([&](std::size_t at, std::uint32_t) { ++begin_[at + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  triangles_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for_each_listed([&](std::size_t at, std::uint32_t t) { triangles_[next[at]++] = t; });
}

void SurfaceParts::cut(const Index3& cell, SurfacePart& part) const {
  const Vector low = kPlaneCell * Vector(cell[0], cell[1], cell[2]);
  const Eigen::AlignedBox3d box(low, low + Vector::Constant(kPlaneCell));
  const std::size_t at = number_of(cell);
  for (std::size_t i = begin_[at]; i < begin_[at + 1]; ++i) {
    const Triangle& t = surface_.triangles[triangles_[i]];
    Polygon piece(vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]);
    if (!box.contains(box_of(t))) piece.clip(box);
    part.corners.insert(part.corners.end(), piece.begin(), piece.end());
  }
  // Neighbours share corners.
  const auto before = [](const Vector& a, const Vector& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::sort(part.corners.begin(), part.corners.end(), before);
  part.corners.erase(std::unique(part.corners.begin(), part.corners.end()), part.corners.end());
  for (const Vector& p : part.corners) part.box.extend(p);
}

}  // namespace vps::bake
