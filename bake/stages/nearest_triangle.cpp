// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time.
#include "bake/stages/nearest_triangle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/nearest_triangle.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_NEAREST_TRIANGLE_ONCE
#define VPS_NEAREST_TRIANGLE_ONCE
namespace vps::bake::detail {

struct Vector3 {
  double x, y, z;
};

// Data for the distance to a triangle. Corners are relative to the lattice's first point.
struct Facet {
  Vector3 corner[3];
  Vector3 edge[3];
  Vector3 outward[3];  // in the triangle's plane, normal to the edge
  double inverse_squared[3];
  Vector3 normal;  // unit
};

struct RowRange {
  int first[2], last[2];  // y, z
};

}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Takes the distance to the triangle's plane over its face, and elsewhere the distance to its nearest edge.
void offer_rows(const Facet& f, const RowRange& rows, double step, double reach, double number, double* squared,
                double* triangle) {
  const hn::CappedTag<double, kBrickEdge> d;
  using V = hn::Vec<decltype(d)>;
  const auto lanes = static_cast<int>(hn::Lanes(d));
  const V zero = hn::Zero(d);
  const V one = hn::Set(d, 1.0);
  const V number_v = hn::Set(d, number);
  for (int z = rows.first[1]; z <= rows.last[1]; ++z) {
    for (int y = rows.first[0]; y <= rows.last[0]; ++y) {
      // Skips a row that stays farther from the triangle's plane than the band.
      const double middle = ((kBrickEdge - 1) / 2.0 * step - f.corner[0].x) * f.normal.x +
                            (y * step - f.corner[0].y) * f.normal.y + (z * step - f.corner[0].z) * f.normal.z;
      if (std::abs(middle) > reach) continue;
      const int row = (z * static_cast<int>(kBrickEdge) + y) * static_cast<int>(kBrickEdge);
      for (int x = 0; x < static_cast<int>(kBrickEdge); x += lanes) {
        const V px = hn::Mul(hn::Iota(d, static_cast<double>(x)), hn::Set(d, step));
        V nearest = hn::Set(d, std::numeric_limits<double>::infinity());
        V farthest_out = hn::Set(d, -std::numeric_limits<double>::infinity());
        for (int k = 0; k < 3; ++k) {
          const V dx = hn::Sub(px, hn::Set(d, f.corner[k].x));
          const double dy = y * step - f.corner[k].y;
          const double dz = z * step - f.corner[k].z;
          const double edge_yz = dy * f.edge[k].y + dz * f.edge[k].z;
          const double out_yz = dy * f.outward[k].y + dz * f.outward[k].z;
          const V along = hn::Mul(hn::Add(hn::Mul(dx, hn::Set(d, f.edge[k].x)), hn::Set(d, edge_yz)),
                                  hn::Set(d, f.inverse_squared[k]));
          const V at = hn::Min(hn::Max(along, zero), one);
          const V ex = hn::Sub(dx, hn::Mul(at, hn::Set(d, f.edge[k].x)));
          const V ey = hn::Sub(hn::Set(d, dy), hn::Mul(at, hn::Set(d, f.edge[k].y)));
          const V ez = hn::Sub(hn::Set(d, dz), hn::Mul(at, hn::Set(d, f.edge[k].z)));
          nearest = hn::Min(nearest, hn::Add(hn::Add(hn::Mul(ex, ex), hn::Mul(ey, ey)), hn::Mul(ez, ez)));
          farthest_out = hn::Max(farthest_out, hn::Add(hn::Mul(dx, hn::Set(d, f.outward[k].x)), hn::Set(d, out_yz)));
        }
        const double height_yz = (y * step - f.corner[0].y) * f.normal.y + (z * step - f.corner[0].z) * f.normal.z;
        const V height =
            hn::Add(hn::Mul(hn::Sub(px, hn::Set(d, f.corner[0].x)), hn::Set(d, f.normal.x)), hn::Set(d, height_yz));
        const V distance = hn::IfThenElse(hn::Lt(farthest_out, zero), hn::Mul(height, height), nearest);
        const V before = hn::Load(d, squared + row + x);
        const auto nearer = hn::Lt(distance, before);
        hn::Store(hn::IfThenElse(nearer, distance, before), d, squared + row + x);
        hn::Store(hn::IfThenElse(nearer, number_v, hn::Load(d, triangle + row + x)), d, triangle + row + x);
      }
    }
  }
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(offer_rows);
}

void offer_triangle(const Surface& surface, std::size_t t, const PointLattice& points, double band,
                    NearestTriangles& nearest) {
  const double s = points.step;
  const Vector& origin = points.first;
  const auto plain = [](const Vector& v) { return detail::Vector3{v.x(), v.y(), v.z()}; };
  detail::Facet facet{};
  for (int k = 0; k < 3; ++k) {
    const Vector edge = surface.corner(t, (k + 1) % 3) - surface.corner(t, k);
    facet.corner[k] = plain(surface.corner(t, k) - origin);
    facet.edge[k] = plain(edge);
    facet.outward[k] = plain(edge.cross(surface.normals[t]));
    facet.inverse_squared[k] = 1 / edge.squaredNorm();
  }
  facet.normal = plain(surface.normals[t]);
  detail::RowRange rows{};
  for (int axis = 1; axis < 3; ++axis) {
    const auto [low, high] =
        std::minmax({surface.corner(t, 0)[axis], surface.corner(t, 1)[axis], surface.corner(t, 2)[axis]});
    const double first = std::ceil((low - origin[axis] - band) / s);
    const double last = std::floor((high - origin[axis] + band) / s);
    rows.first[axis - 1] = static_cast<int>(std::clamp(first, 0.0, double{kBrickEdge}));
    rows.last[axis - 1] = static_cast<int>(std::clamp(last, -1.0, points.edge - 1.0));
  }
  const double reach = (band + std::abs(facet.normal.x) * ((kBrickEdge - 1) / 2.0) * s) * (1 + 1e-9);
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(offer_rows)
  (facet, rows, s, reach, static_cast<double>(t), nearest.squared.data(), nearest.triangle.data());
}

}  // namespace vps::bake
#endif
