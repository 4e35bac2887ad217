// SPDX-License-Identifier: GPL-3.0-or-later
// The open mesh's winding number is that of the filled one, a whole number, less the patches' share of all directions.
#include "bake/repair/judge_filling.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <utility>

#include "bake/repair/topology.h"
#include "bake/repair/winding.h"

namespace vps::bake {
namespace {

// Share of all directions in which the patches are seen from p (van Oosterom and Strackee 1983).
double patches_seen_from(const Vector& p, const Filling& filling) {
  double half_angles = 0;
  for (std::size_t t = filling.patches; t < filling.mesh.triangles.size(); ++t) {
    const Vector a = filling.mesh.corner(t, 0) - p;
    const Vector b = filling.mesh.corner(t, 1) - p;
    const Vector c = filling.mesh.corner(t, 2) - p;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    half_angles += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return std::abs(half_angles) / (2 * std::numbers::pi);
}

int winding_number(const InsideTest& lines, const Mesh& mesh, const Vector& p) {
  int winding = 0;
  lines.for_each_crossing(p, [&](std::uint32_t t, int crossing) {
    if (crossing_is_beyond(p, mesh, t)) winding -= crossing;
  });
  return winding;
}

// Points in each direction of the box: fewer where there are many patches, as each point looks at all of them.
std::size_t points_along(std::size_t patch_triangles) {
  constexpr double kMostWork = 5e7;
  const double points = kMostWork / static_cast<double>(std::max<std::size_t>(patch_triangles, 1));
  return static_cast<std::size_t>(std::clamp(std::cbrt(points), 12.0, 32.0));
}

double hardly_surrounded(const Filling& filling, const Mesh& solid) {
  constexpr double kSeen = 1.0 / 3;
  const Mesh& mesh = filling.mesh;
  const Grid mesh_grid = column_grid(mesh);
  const Grid solid_grid = column_grid(solid);
  const InsideTest mesh_lines(mesh, mesh_grid);
  const InsideTest solid_lines(solid, solid_grid);
  Vector low = solid.vertices.front();
  Vector high = low;
  for (const Vector& v : solid.vertices) {
    low = low.cwiseMin(v);
    high = high.cwiseMax(v);
  }
  const std::size_t n = points_along(mesh.triangles.size() - filling.patches);
  using Counts = std::pair<std::size_t, std::size_t>;  // points inside, and those of them in doubt
  const auto count = [&](const tbb::blocked_range<std::size_t>& range, Counts counts) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Vector cell(static_cast<double>(i % n), static_cast<double>(i / n % n), static_cast<double>(i / (n * n)));
      const Vector p = low + (high - low).cwiseProduct((cell.array() + 0.5).matrix() / static_cast<double>(n));
      if (!solid_lines.inside(p)) continue;
      ++counts.first;
      // Inside two shells at once a hole in one of them does not matter.
      if (std::abs(winding_number(mesh_lines, mesh, p)) < 2) counts.second += patches_seen_from(p, filling) > kSeen;
    }
    return counts;
  };
  const Counts counts = tbb::parallel_reduce(tbb::blocked_range<std::size_t>(0, n * n * n, n), Counts{}, count,
                                             [](const Counts& a, const Counts& b) {
                                               return Counts{a.first + b.first, a.second + b.second};
                                             });
  return counts.first > 0 ? static_cast<double>(counts.second) / static_cast<double>(counts.first) : 0;
}

double share_of_sheets(const Filling& filling) {
  const Mesh& mesh = filling.mesh;
  struct Piece {
    double area = 0;  // without patches
    double volume6 = 0;
    bool filled = false;
  };
  const Pieces pieces = closed_pieces(mesh.triangles);
  std::vector<Piece> all(pieces.count);
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Piece& piece = all[pieces.of_triangle[t]];
    const Vector normal = mesh.area_normal(t);
    piece.volume6 += (mesh.corner(t, 0) - mesh.corner(0, 0)).dot(normal);
    if (t >= filling.patches) {
      piece.filled = true;
    } else {
      piece.area += normal.norm() / 2;
      area += normal.norm() / 2;
    }
  }
  double sheets = 0;
  for (const Piece& piece : all) {
    // A cube encloses 0.07 of this measure, a lone triangle nothing.
    constexpr double kFlat = 1e-3;
    if (piece.filled && std::abs(piece.volume6) / 6 < kFlat * piece.area * std::sqrt(piece.area)) sheets += piece.area;
  }
  return area > 0 ? sheets / area : 0;
}

}  // namespace

std::size_t drop_flat_sheets(Mesh& mesh, std::size_t patches) {
  struct Piece {
    Vector normal = Vector::Zero();  // twice the area of its largest triangle, in whose plane it lies if it is flat
    Vector corner;                   // of that triangle
    bool filled = false, bends = false;
  };
  const Pieces pieces = closed_pieces(mesh.triangles);
  std::vector<Piece> all(pieces.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Piece& piece = all[pieces.of_triangle[t]];
    piece.filled |= t >= patches;
    const Vector normal = mesh.area_normal(t);
    if (normal.squaredNorm() > piece.normal.squaredNorm()) {
      piece.normal = normal;
      piece.corner = mesh.corner(t, 0);
    }
  }
  // Single precision bends a leaf of a thousandth of the mesh's size by so much of its own.
  constexpr double kRounding = 1e-4;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Piece& piece = all[pieces.of_triangle[t]];
    const double most = kRounding * std::pow(piece.normal.norm(), 1.5);
    for (int k = 0; k < 3; ++k) {
      piece.bends |= !(std::abs((mesh.corner(t, k) - piece.corner).dot(piece.normal)) <= most);
    }
  }
  const auto is_flat = [](const Piece& piece) { return piece.filled && !piece.bends; };
  const auto dropped = static_cast<std::size_t>(std::count_if(all.begin(), all.end(), is_flat));
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!is_flat(all[pieces.of_triangle[t]])) mesh.triangles[kept++] = mesh.triangles[t];
  }
  mesh.triangles.resize(kept);
  if (dropped > 0) drop_unused_vertices(mesh);
  return dropped;
}

FillingDoubts judge_filling(const Filling& filling, const Mesh& solid) {
  return {hardly_surrounded(filling, solid), share_of_sheets(filling)};
}

}  // namespace vps::bake
