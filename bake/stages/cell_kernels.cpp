// SPDX-License-Identifier: GPL-3.0-or-later
// Compiled once per instruction set by Highway, chosen at run time. Every operation is rounded by itself, so that all
// give the same bits.
#include "bake/stages/cell_kernels.h"

#include <algorithm>
#include <cmath>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/stages/cell_kernels.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#ifndef VPS_CELL_KERNELS_COMMON
#define VPS_CELL_KERNELS_COMMON
namespace vps::bake::detail {
inline constexpr float kFar = std::numeric_limits<float>::infinity();
inline constexpr float kHalfOfDiagonal = 0.8660255F;  // of a cube whose edge is 1, rounded up
inline constexpr float kLonger = 0.25F;
inline constexpr float kBeyondCore = 0.45F;  // kSheetThickness and this are less than half a voxel's diagonal
}  // namespace vps::bake::detail
#endif

HWY_BEFORE_NAMESPACE();
namespace vps::bake::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr hn::CappedTag<float, kCubeCells> cell_lanes;
using Lanes = hn::Vec<decltype(cell_lanes)>;

HWY_INLINE Lanes all(float value) {
  return hn::Set(cell_lanes, value);
}
struct Places {
  Lanes x, y, z;
};
HWY_INLINE Lanes dot(float a, float b, float c, const Places& p) {
  return hn::Add(hn::Add(hn::Mul(all(a), p.x), hn::Mul(all(b), p.y)), hn::Mul(all(c), p.z));
}
HWY_INLINE Lanes dot(const Places& a, const float (&b)[3]) {
  return dot(b[0], b[1], b[2], a);
}
HWY_INLINE Lanes value(const FloatTriangle::Linear& f, const Places& p) {
  return hn::Add(dot(f.a, f.b, f.c, p), all(f.d));
}

// As in float_distances.cpp. `foot` receives the vector from the closest point, if it is asked for.
template <bool kWithVector>
HWY_INLINE Lanes distance(const FloatTriangle& f, const Places& p, Places& from) {
  const Lanes zero = hn::Zero(cell_lanes);
  Lanes nearest = all(kFar);
  Lanes farthest_out = all(-kFar);
  Places beside{zero, zero, zero};
  for (int k = 0; k < 3; ++k) {
    const Lanes along = value(f.along[k], p);
    const Lanes out = value(f.outward[k], p);
    const Lanes beyond = hn::Sub(along, hn::Min(hn::Max(along, zero), all(f.length[k])));
    const Lanes squared = hn::Add(hn::Mul(beyond, beyond), hn::Mul(out, out));
    farthest_out = hn::Max(farthest_out, out);
    if constexpr (kWithVector) {
      const auto closer = hn::Lt(squared, nearest);
      const auto part = [&](float a, float b, Lanes old) {
        return hn::IfThenElse(closer, hn::Add(hn::Mul(all(a), beyond), hn::Mul(all(b), out)), old);
      };
      beside = {part(f.along[k].a, f.outward[k].a, beside.x), part(f.along[k].b, f.outward[k].b, beside.y),
                part(f.along[k].c, f.outward[k].c, beside.z)};
    }
    nearest = hn::Min(nearest, squared);
  }
  const Lanes height = value(f.height, p);
  const auto over = hn::Lt(farthest_out, zero);
  if constexpr (kWithVector) {
    const auto part = [&](float a, Lanes side) {
      return hn::Add(hn::Mul(all(a), height), hn::IfThenZeroElse(over, side));
    };
    from = {part(f.height.a, beside.x), part(f.height.b, beside.y), part(f.height.c, beside.z)};
  }
  return hn::Sqrt(hn::Add(hn::Mul(height, height), hn::IfThenZeroElse(over, nearest)));
}

// Half the cell's edge in the direction of a corner's axis.
HWY_INLINE Lanes of_corner(int corner, int axis, Lanes half) {
  return (corner >> axis & 1) != 0 ? half : hn::Neg(half);
}

struct Sheet {
  Places normal;
  Lanes offset;        // the plane's height is normal.p + offset
  Lanes above, below;  // of the stored values over the plane
  hn::Mask<decltype(cell_lanes)> steep;
};

// The plane that is nearest to the values at the corners.
HWY_INLINE Sheet fit(const SheetCells& cells, std::size_t i, const Places& m) {
  Lanes f[8];
  Lanes sum = hn::Zero(cell_lanes);
  Lanes g[3] = {sum, sum, sum};
  for (int corner = 0; corner < 8; ++corner) {
    f[corner] = hn::Load(cell_lanes, cells.most_stored[static_cast<std::size_t>(corner)].data() + i);
    sum = hn::Add(sum, f[corner]);
    for (int axis = 0; axis < 3; ++axis) g[axis] = hn::Add(g[axis], of_corner(corner, axis, f[corner]));
  }
  const Lanes mean = hn::Mul(sum, all(0.125F));
  const Lanes squared = hn::Add(hn::Add(hn::Mul(g[0], g[0]), hn::Mul(g[1], g[1])), hn::Mul(g[2], g[2]));
  const Lanes length = hn::Sqrt(squared);
  Sheet sheet;
  sheet.steep = hn::Ge(length, all(2 * cells.edge));
  sheet.normal = {hn::Div(g[0], length), hn::Div(g[1], length), hn::Div(g[2], length)};
  const Places& n = sheet.normal;
  sheet.offset = hn::Sub(mean, hn::Add(hn::Add(hn::Mul(n.x, m.x), hn::Mul(n.y, m.y)), hn::Mul(n.z, m.z)));
  sheet.above = all(-kFar);
  sheet.below = all(kFar);
  const Lanes half = all(cells.edge / 2);
  const Lanes step[3] = {hn::Mul(n.x, half), hn::Mul(n.y, half), hn::Mul(n.z, half)};
  for (int corner = 0; corner < 8; ++corner) {
    const Lanes plane = hn::Add(hn::Add(mean, of_corner(corner, 0, step[0])),
                                hn::Add(of_corner(corner, 1, step[1]), of_corner(corner, 2, step[2])));
    const Lanes least = hn::Load(cell_lanes, cells.least_stored[static_cast<std::size_t>(corner)].data() + i);
    sheet.above = hn::Max(sheet.above, hn::Sub(hn::Max(f[corner], least), plane));
    sheet.below = hn::Min(sheet.below, hn::Sub(hn::Min(f[corner], least), plane));
  }
  return sheet;
}

HWY_INLINE Lanes length_1(Lanes x, Lanes y, Lanes z) {
  return hn::Add(hn::Add(hn::Abs(x), hn::Abs(y)), hn::Abs(z));
}

void by_plane(const ProofTriangle* triangles, std::span<const std::uint32_t> near, SheetCells& cells,
              std::array<float, kCubeCells>* distances) {
  const Lanes infinite = all(kFar);
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    const Places m{hn::Load(cell_lanes, cells.x.data() + i), hn::Load(cell_lanes, cells.y.data() + i),
                   hn::Load(cell_lanes, cells.z.data() + i)};
    Lanes least = infinite;
    for (std::size_t n = 0; n < near.size(); ++n) {
      Places unused;
      const Lanes d = distance<false>(triangles[near[n]], m, unused);
      hn::StoreU(d, cell_lanes, distances[n].data() + i);
      least = hn::Min(least, d);
    }
    const float half = kHalfOfDiagonal * cells.edge;
    const Lanes nearest = hn::Add(least, all(2 * cells.error + 1e-5F));
    // Points of the cell count up to the distance `far`; a line along the sheet's normal is longer by `more` at most.
    const Lanes known = all(cells.core + kBeyondCore);
    const auto all_known = hn::Le(hn::Add(least, all(half)), known);
    const Lanes far = hn::Min(hn::Add(least, all(half)), known);
    const Lanes more = hn::Min(hn::Mul(far, all(kLonger)), all(kSheetThickness));
    const Lanes least_facing = hn::Div(far, hn::Add(far, more));
    const Lanes reach = hn::Max(hn::Add(hn::Add(far, more), all(half + 2 * cells.error)), nearest);
    const Sheet sheet = fit(cells, i, m);
    auto good = hn::And(sheet.steep, hn::Le(least, all(cells.core + half)));
    Lanes low = infinite, high = hn::Neg(infinite), lowest = infinite, highest = high;
    Lanes corners_low = infinite, corners_high = high;
    // Where the centre lies beyond the core, places in the sphere around the cell count, too.
    const Lanes half_edge = hn::IfThenElse(hn::Le(least, all(cells.core)), all(cells.edge / 2), all(half));
    const Lanes at_centre = hn::Add(
        hn::Add(hn::Add(hn::Mul(sheet.normal.x, m.x), hn::Mul(sheet.normal.y, m.y)), hn::Mul(sheet.normal.z, m.z)),
        sheet.offset);
    for (std::size_t n = 0; n < near.size(); ++n) {
      const Lanes d = hn::LoadU(cell_lanes, distances[n].data() + i);
      const auto counts = hn::Le(d, reach);
      if (hn::AllFalse(cell_lanes, counts)) continue;
      const ProofTriangle& t = triangles[near[n]];
      const Lanes height = value(t.plane, m);
      const auto closest = hn::Le(d, nearest);
      lowest = hn::IfThenElse(closest, hn::Min(lowest, height), lowest);
      highest = hn::IfThenElse(closest, hn::Max(highest, height), highest);
      const float normal[3] = {t.plane.a, t.plane.b, t.plane.c};
      const Lanes facing = dot(sheet.normal, normal);
      good = hn::And(good, hn::Or(hn::Not(counts), hn::Ge(facing, least_facing)));
      Lanes corner_low = infinite, corner_high = hn::Neg(infinite);
      for (const auto& corner : t.corner) {
        const Lanes at = hn::Add(dot(sheet.normal, corner), sheet.offset);
        corner_low = hn::Min(corner_low, at);
        corner_high = hn::Max(corner_high, at);
      }
      corners_low = hn::IfThenElse(counts, hn::Min(corners_low, corner_low), corners_low);
      corners_high = hn::IfThenElse(counts, hn::Max(corners_high, corner_high), corners_high);
      // The place where a line meets the triangle's plane: along the triangle's normal, and along the sheet's.
      Lanes plane_low = infinite, plane_high = hn::Neg(infinite);
      for (const Lanes ratio : {facing, hn::Div(all(1), facing)}) {
        const Lanes at = hn::Sub(at_centre, hn::Mul(height, ratio));
        const Lanes range = hn::Mul(length_1(hn::Sub(sheet.normal.x, hn::Mul(all(normal[0]), ratio)),
                                             hn::Sub(sheet.normal.y, hn::Mul(all(normal[1]), ratio)),
                                             hn::Sub(sheet.normal.z, hn::Mul(all(normal[2]), ratio))),
                                    half_edge);
        plane_low = hn::Min(plane_low, hn::Sub(at, range));
        plane_high = hn::Max(plane_high, hn::Add(at, range));
      }
      low = hn::IfThenElse(counts, hn::Min(low, hn::Max(corner_low, plane_low)), low);
      high = hn::IfThenElse(counts, hn::Max(high, hn::Min(corner_high, plane_high)), high);
    }
    // Needs no sheet: the surface's points do not lie beyond the corners.
    const Lanes error_4 = all(4 * cells.error);
    hn::Store(
        hn::IfThenElse(sheet.steep, hn::Add(hn::Add(sheet.above, hn::IfThenElse(good, high, corners_high)), error_4),
                       infinite),
        cell_lanes, cells.above.data() + i);
    hn::Store(hn::IfThenElse(sheet.steep,
                             hn::Sub(error_4, hn::Add(sheet.below, hn::IfThenElse(good, low, corners_low))), infinite),
              cell_lanes, cells.below.data() + i);
    good = hn::And(good, hn::Or(all_known, hn::Le(hn::Sub(high, low), all(kBeyondCore - 4 * cells.error))));
    const Lanes bound = hn::Max(hn::Add(sheet.above, high), hn::Neg(hn::Add(sheet.below, low)));
    hn::Store(hn::IfThenElse(good, hn::Add(hn::Max(bound, hn::Zero(cell_lanes)), all(4 * cells.error)), infinite),
              cell_lanes, cells.bound.data() + i);
    hn::Store(least, cell_lanes, cells.least.data() + i);
    hn::Store(reach, cell_lanes, cells.reach.data() + i);
    hn::Store(lowest, cell_lanes, cells.lowest.data() + i);
    hn::Store(highest, cell_lanes, cells.highest.data() + i);
  }
}

// Calls value(places, first corner) for all corners of a cell. @return the largest value
template <class Value>
HWY_INLINE float largest(const ClearCell& cell, Value value) {
  Lanes most = all(-kFar);
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    most = hn::Max(most, value(Places{hn::Load(cell_lanes, cell.x.data() + i), hn::Load(cell_lanes, cell.y.data() + i),
                                      hn::Load(cell_lanes, cell.z.data() + i)},
                               i));
  }
  return hn::GetLane(hn::MaxOfLanes(cell_lanes, most));
}

// A linear function that is nowhere above the distance from a triangle, and at most a unit steep.
struct Floor {
  float a, b, c, d;
};

// How far the stored values are above a floor, and the floor below 0.
struct AboveFloor {
  float above, below_zero;
};
HWY_INLINE AboveFloor above_floor(const ClearCell& cell, const Floor& floor) {
  const auto height = [&](const Places& p) { return hn::Add(dot(floor.a, floor.b, floor.c, p), all(floor.d)); };
  const float above = largest(cell, [&](const Places& p, std::size_t i) {
    return hn::Sub(hn::Load(cell_lanes, cell.most_stored.data() + i), height(p));
  });
  return {above, largest(cell, [&](const Places& p, std::size_t) { return hn::Neg(height(p)); })};
}

// The triangle's plane, seen from the cell's centre.
HWY_INLINE Floor plane_floor(const ProofTriangle& t, const ClearCell& cell) {
  const auto& [x, y, z] = cell.centre;
  const float side = t.plane.a * x + t.plane.b * y + t.plane.c * z + t.plane.d < 0 ? -1.0F : 1.0F;
  return {side * t.plane.a, side * t.plane.b, side * t.plane.c, side * t.plane.d};
}

// All of the triangle lies behind the plane along a direction.
HWY_INLINE Floor floor_along(const ProofTriangle& t, const std::array<float, 3>& u) {
  float farthest = -kFar;
  for (const auto& c : t.corner) farthest = std::max(farthest, u[0] * c[0] + u[1] * c[1] + u[2] * c[2]);
  return {u[0], u[1], u[2], -farthest};
}

// All of the triangle lies behind the tangent of its distance at a place.
HWY_INLINE Floor tangent_floor(const ProofTriangle& t, const std::array<float, 3>& place) {
  Places from;
  const Lanes d = distance<true>(t, {all(place[0]), all(place[1]), all(place[2])}, from);
  const float length = hn::GetLane(d);
  // A little shorter than 1, so that rounding does not make it longer.
  const float scale = length > 1e-3F ? (1 - 1e-5F) / length : 0;
  return floor_along(t, {hn::GetLane(from.x) * scale, hn::GetLane(from.y) * scale, hn::GetLane(from.z) * scale});
}

// The direction in which the stored values grow.
HWY_INLINE std::array<float, 3> slope(const ClearCell& cell) {
  float g[3] = {0, 0, 0};
  for (std::size_t c = 0; c < 8; ++c) {
    for (int axis = 0; axis < 3; ++axis) g[axis] += (c >> axis & 1) != 0 ? cell.most_stored[c] : -cell.most_stored[c];
  }
  const float length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  const float scale = length > 0.1F ? (1 - 1e-5F) / length : 0;
  return {g[0] * scale, g[1] * scale, g[2] * scale};
}

OneSidedBounds by_triangles(const ProofTriangle* triangles, std::span<const std::uint32_t> near,
                            const ClearCell& cell) {
  OneSidedBounds out{cell.above, kFar};
  const bool to_do = cell.above > cell.enough;
  if (to_do) out.above = 0;
  for (const std::uint32_t n : to_do ? near : near.first(0)) {
    const ProofTriangle& t = triangles[n];
    const float error = 2 * t.error;
    AboveFloor floor = above_floor(cell, plane_floor(t, cell));
    if (floor.above + error > cell.enough || floor.below_zero + error >= 0) {
      const AboveFloor other = above_floor(cell, tangent_floor(t, cell.centre));
      floor = {std::min(floor.above, other.above), std::min(floor.below_zero, other.below_zero)};
    }
    if (floor.above + error > cell.enough) {
      const AboveFloor other = above_floor(cell, floor_along(t, slope(cell)));
      floor = {std::min(floor.above, other.above), std::min(floor.below_zero, other.below_zero)};
    }
    if (floor.below_zero + error >= 0) return {kFar, kFar};
    if (-floor.below_zero - error <= cell.core) out.above = std::max(out.above, floor.above + error);
    if (out.above > cell.enough) return {kFar, kFar};
  }
  for (const std::uint32_t n : near) {
    const ProofTriangle& t = triangles[n];
    const float below = largest(cell, [&](const Places& p, std::size_t i) {
      Places unused;
      return hn::Sub(distance<false>(t, p, unused), hn::Load(cell_lanes, cell.least_stored.data() + i));
    });
    out.below = std::min(out.below, below + 2 * t.error);
    if (out.below <= cell.enough) break;
  }
  return out;
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(by_plane);
HWY_EXPORT(by_triangles);
}  // namespace detail

void prove_by_plane(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                    std::span<std::array<float, kCubeCells>> distances) {
  using namespace detail;  // Highway's macros take names without a namespace
  HWY_DYNAMIC_DISPATCH(by_plane)(triangles.data(), near, cells, distances.data());
}

OneSidedBounds prove_by_triangles(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near,
                                  const ClearCell& cell) {
  using namespace detail;
  return HWY_DYNAMIC_DISPATCH(by_triangles)(triangles.data(), near, cell);
}

}  // namespace vps::bake
#endif
