// SPDX-License-Identifier: GPL-3.0-or-later
// Exact line-triangle crossings with CGAL's filtered predicates.
#include "bake/repair/winding.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bake/stages/voxelize.h"

namespace vps::bake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point2 = Kernel::Point_2;
using Point3 = Kernel::Point_3;

// On which side of the edge p -> q (projected along x) the line lies, never 0 unless the edge projects to a point.
int side_of_edge(double y, double z, const Vector& p, const Vector& q) {
  const CGAL::Orientation side = CGAL::orientation(Point2(p.y(), p.z()), Point2(q.y(), q.z()), Point2(y, z));
  if (side != CGAL::COLLINEAR) return side == CGAL::POSITIVE ? 1 : -1;
  // The line moved to (y + e, z + e^2): the determinant's first non-zero term decides.
  if (q.z() != p.z()) return q.z() > p.z() ? -1 : 1;
  if (q.y() != p.y()) return q.y() > p.y() ? 1 : -1;
  return 0;
}

CGAL::Orientation orientation(const Vector& a, const Vector& b, const Vector& c, const Vector& d) {
  const auto point = [](const Vector& v) { return Point3(v.x(), v.y(), v.z()); };
  return CGAL::orientation(point(a), point(b), point(c), point(d));
}

// The grid with its voxels joined, so that a triangle meets about 64 columns and no more. More columns would only take
// memory: each has the same few triangles as its neighbours.
Grid columns_for(const Mesh& mesh, const Grid& grid) {
  double sum = 0;  // of the triangles' edges along y and z
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector size = mesh.corner(t, 0).cwiseMax(mesh.corner(t, 1)).cwiseMax(mesh.corner(t, 2)) -
                        mesh.corner(t, 0).cwiseMin(mesh.corner(t, 1)).cwiseMin(mesh.corner(t, 2));
    sum += (size.y() + size.z()) / 2;
  }
  constexpr double kColumns = 8;  // of a triangle along an axis
  const double wanted = sum / static_cast<double>(mesh.triangles.size()) / kColumns / grid.voxel_size;
  const auto joined = static_cast<std::uint32_t>(std::clamp(wanted, 1.0, 64.0));
  Grid columns = grid;
  columns.voxel_size *= joined;
  for (std::uint32_t& count : columns.dims) count = (count + joined - 1) / joined;
  return columns;
}

}  // namespace

int line_crossing(double y, double z, const Vector& a, const Vector& b, const Vector& c) {
  if (y < std::min({a.y(), b.y(), c.y()}) || y > std::max({a.y(), b.y(), c.y()}) ||
      z < std::min({a.z(), b.z(), c.z()}) || z > std::max({a.z(), b.z(), c.z()})) {
    return 0;
  }
  const int first = side_of_edge(y, z, a, b);
  if (first == 0 || first != side_of_edge(y, z, b, c) || first != side_of_edge(y, z, c, a)) return 0;
  // Counter-clockwise in (y, z) means the normal points to +x: the line leaves the solid.
  return -first;
}

double crossing_x(double y, double z, const Mesh& mesh, std::size_t triangle) {
  const Vector& a = mesh.corner(triangle, 0);
  const Vector n = (mesh.corner(triangle, 1) - a).cross(mesh.corner(triangle, 2) - a);
  const double x = a.x() - (n.y() * (y - a.y()) + n.z() * (z - a.z())) / n.x();
  // A triangle nearly parallel to x amplifies rounding, so its own extent limits the result.
  const auto [low, high] = std::minmax({a.x(), mesh.corner(triangle, 1).x(), mesh.corner(triangle, 2).x()});
  return x >= low ? std::min(x, high) : low;
}

bool crossing_is_beyond(const Vector& point, const Mesh& mesh, std::size_t triangle) {
  const Vector& a = mesh.corner(triangle, 0);
  const Vector& b = mesh.corner(triangle, 1);
  const Vector& c = mesh.corner(triangle, 2);
  const CGAL::Orientation side = orientation(a, b, c, point);
  if (side == CGAL::ZERO) return false;
  // POSITIVE: the point is on the normal's side. Going to +x it meets the plane if the normal points to -x.
  const bool normal_to_plus_x = line_crossing(point.y(), point.z(), mesh, triangle) < 0;
  return (side == CGAL::POSITIVE) != normal_to_plus_x;
}

bool point_on_plane(const Vector& point, const Mesh& mesh, std::size_t triangle) {
  return orientation(mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2), point) == CGAL::ZERO;
}

Grid column_grid(const Mesh& mesh) {
  Vector low = mesh.vertices.front();
  Vector high = low;
  for (const Vector& v : mesh.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const double columns = std::clamp(std::sqrt(static_cast<double>(mesh.triangles.size())), 1.0, 1024.0);
  Grid grid;
  grid.voxel_size = (high - low).maxCoeff() / columns;
  grid.origin = low;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cells = (high - low)[static_cast<Eigen::Index>(axis)] / grid.voxel_size;
    grid.dims[axis] = static_cast<std::uint32_t>(cells) + 1;
  }
  return grid;
}

InsideTest::InsideTest(const Mesh& mesh, const Grid& grid) : mesh_(mesh), columns_(columns_for(mesh, grid)) {
  const double slack = rounding_slack(columns_) + 1e-9 * columns_.voxel_size;
  const auto for_each_column = [&](auto visit) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vector low = mesh.corner(t, 0).cwiseMin(mesh.corner(t, 1)).cwiseMin(mesh.corner(t, 2));
      const Vector high = mesh.corner(t, 0).cwiseMax(mesh.corner(t, 1)).cwiseMax(mesh.corner(t, 2));
      const VoxelRange js = voxel_range(columns_, 1, low.y(), high.y(), slack);
      const VoxelRange ks = voxel_range(columns_, 2, low.z(), high.z(), slack);
      for (std::uint32_t k = ks.first; k <= ks.last; ++k) {
        for (std::uint32_t j = js.first; j <= js.last; ++j) visit(std::size_t{k} * columns_.dims[1] + j, t);
      }
    }
  };
  const auto rounded = [](double value, float towards) {
    const auto near = static_cast<float>(value);
    const bool beyond = towards > 0 ? near < value : near > value;
    return beyond ? std::nextafter(near, towards) : near;
  };
  constexpr float kEnd = std::numeric_limits<float>::infinity();
  boxes_.reserve(mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector low = mesh.corner(t, 0).cwiseMin(mesh.corner(t, 1)).cwiseMin(mesh.corner(t, 2));
    const Vector high = mesh.corner(t, 0).cwiseMax(mesh.corner(t, 1)).cwiseMax(mesh.corner(t, 2));
    boxes_.push_back({{rounded(low.y(), -kEnd), rounded(high.y(), kEnd)},
                      {rounded(low.z(), -kEnd), rounded(high.z(), kEnd)},
                      rounded(high.x(), kEnd)});
  }
  start_.assign(std::size_t{columns_.dims[1]} * columns_.dims[2] + 1, 0);
  for_each_column([&](std::size_t column, std::uint32_t) { ++start_[column + 1]; });
  for (std::size_t i = 1; i < start_.size(); ++i) start_[i] += start_[i - 1];
  triangles_.resize(start_.back());
  std::vector<std::size_t> fill(start_.begin(), start_.end() - 1);
  for_each_column([&](std::size_t column, std::uint32_t t) { triangles_[fill[column]++] = t; });
}

std::size_t InsideTest::column(double y, double z) const {
  const auto index = [&](double x, int axis) {
    const double cell = std::floor((x - columns_.origin[axis]) / columns_.voxel_size);
    return static_cast<std::size_t>(std::clamp(cell, 0.0, columns_.dims[static_cast<std::size_t>(axis)] - 1.0));
  };
  return index(z, 2) * columns_.dims[1] + index(y, 1);
}

bool InsideTest::inside(const Vector& point) const {
  // The crossings beyond the point sum to minus the winding number at the point.
  int winding = 0;
  const std::size_t at = column(point.y(), point.z());
  for (std::size_t i = start_[at]; i < start_[at + 1]; ++i) {
    const std::uint32_t triangle = triangles_[i];
    const Box& box = boxes_[triangle];
    // A crossing lies in the triangle.
    if (box.most_x < point.x() || point.y() < box.y[0] || point.y() > box.y[1] || point.z() < box.z[0] ||
        point.z() > box.z[1]) {
      continue;
    }
    const int crossing = line_crossing(point.y(), point.z(), mesh_, triangle);
    if (crossing == 0) continue;
    const auto [low, high] =
        std::minmax({mesh_.corner(triangle, 0).x(), mesh_.corner(triangle, 1).x(), mesh_.corner(triangle, 2).x()});
    if (high < point.x()) continue;
    if (low > point.x() || crossing_is_beyond(point, mesh_, triangle)) winding -= crossing;
  }
  return winding > 0;
}

}  // namespace vps::bake
