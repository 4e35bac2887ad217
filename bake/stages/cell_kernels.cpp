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
inline constexpr float kLonger = 0.4F;
inline constexpr float kFarShare = 0.75F;
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

// The largest value(distance, first corner) at the corners of a cell.
template <class Value>
HWY_INLINE float largest_at_corners(const ProofTriangle& t, const float* centre, float edge, Value value) {
  alignas(32) static constexpr float kSigns[3][8] = {
      {-1, 1, -1, 1, -1, 1, -1, 1}, {-1, -1, 1, 1, -1, -1, 1, 1}, {-1, -1, -1, -1, 1, 1, 1, 1}};
  Lanes most = all(-kFar);
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    const auto place = [&](std::size_t axis) HWY_ATTR {
      return hn::Add(all(centre[axis]), hn::Mul(hn::Load(cell_lanes, kSigns[axis] + i), all(edge / 2)));
    };
    Places unused;
    most = hn::Max(most, value(distance<false>(t, {place(0), place(1), place(2)}, unused), i));
  }
  return hn::GetLane(hn::MaxOfLanes(cell_lanes, most));
}

// The distances of centres from all triangles, and which is closest.
HWY_INLINE void measure_distances(const ProofTriangle* triangles, std::span<const std::uint32_t> near,
                                  SheetCells& cells, OfCells* distances) {
  for (const std::uint32_t n : near) cells.error = std::max(cells.error, triangles[n].error);
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    const Places m{hn::Load(cell_lanes, cells.x.data() + i), hn::Load(cell_lanes, cells.y.data() + i),
                   hn::Load(cell_lanes, cells.z.data() + i)};
    Lanes least = all(kFar), closest = hn::Zero(cell_lanes);
    for (std::size_t n = 0; n < near.size(); ++n) {
      Places unused;
      const Lanes d = distance<false>(triangles[near[n]], m, unused);
      hn::StoreU(d, cell_lanes, distances[n].data() + i);
      closest = hn::IfThenElse(hn::Lt(d, least), all(static_cast<float>(n)), closest);
      least = hn::Min(least, d);
    }
    hn::Store(least, cell_lanes, cells.least.data() + i);
    hn::Store(closest, cell_lanes, cells.closest.data() + i);
  }
  for (std::size_t n = 0; n < kCubeCells; ++n) {
    cells.far[n] = std::min(cells.farthest, cells.least[n] + kHalfOfDiagonal * cells.edge);
    // The distance to a triangle is convex. Beyond the core a sphere around the cell counts.
    if (cells.least[n] > cells.core || cells.least[n] > cells.edge) continue;
    const ProofTriangle& t = triangles[near[static_cast<std::size_t>(cells.closest[n])]];
    const float centre[3] = {cells.x[n], cells.y[n], cells.z[n]};
    const float most = largest_at_corners(t, centre, cells.edge, [](Lanes d, std::size_t) HWY_ATTR { return d; });
    cells.far[n] = std::min(cells.far[n], most + 2 * t.error);
  }
}

template <bool kSheet>
HWY_INLINE void by_sheet(const ProofTriangle* triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                         OfCells* distances) {
  measure_distances(triangles, near, cells, distances);
  const Lanes infinite = all(kFar);
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    const Places m{hn::Load(cell_lanes, cells.x.data() + i), hn::Load(cell_lanes, cells.y.data() + i),
                   hn::Load(cell_lanes, cells.z.data() + i)};
    const Lanes least = hn::Load(cell_lanes, cells.least.data() + i);
    const float half = kHalfOfDiagonal * cells.edge;
    const Lanes nearest = hn::Add(least, all(2 * cells.error + 1e-5F));
    // Points of the cell count up to the distance `far`; a line along the sheet's normal is longer by `more` at most.
    const Lanes known = all(cells.core + kBeyondCore);
    const Lanes farthest = hn::Load(cell_lanes, cells.far.data() + i);
    const auto all_known = hn::Le(farthest, known);
    const Lanes far = hn::Min(farthest, known);
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
      if constexpr (!kSheet) continue;
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
    hn::Store(reach, cell_lanes, cells.reach.data() + i);
    hn::Store(lowest, cell_lanes, cells.lowest.data() + i);
    hn::Store(highest, cell_lanes, cells.highest.data() + i);
  }
}

void by_plane(const ProofTriangle* triangles, std::span<const std::uint32_t> near, SheetCells& cells,
              OfCells* distances) {
  by_sheet<true>(triangles, near, cells, distances);
}
void by_nothing(const ProofTriangle* triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                OfCells* distances) {
  by_sheet<false>(triangles, near, cells, distances);
  cells.bound.fill(kFar);
  cells.above.fill(kFar);
  cells.below.fill(kFar);
}

OfCells by_samples(const SheetCells& cells, const std::array<OfCells, kCubeCells>& exact) {
  OfCells out;
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    const Lanes zero = hn::Zero(cell_lanes);
    const auto inside = hn::Lt(hn::LoadU(cell_lanes, exact[0].data() + i), zero);
    const auto outwards = [&](Lanes v) HWY_ATTR { return hn::IfThenElse(inside, hn::Neg(v), v); };
    Lanes distance[8];
    Lanes least = all(kFar), above = zero;
    for (std::size_t c = 0; c < 8; ++c) {
      distance[c] = outwards(hn::LoadU(cell_lanes, exact[c].data() + i));
      const Lanes stored = hn::Max(outwards(hn::Load(cell_lanes, cells.most_stored[c].data() + i)),
                                   outwards(hn::Load(cell_lanes, cells.least_stored[c].data() + i)));
      least = hn::Min(least, distance[c]);
      above = hn::Max(above, hn::Sub(stored, distance[c]));
    }
    // By how much the squares of the edges exceed those of the least differences along them.
    Lanes missing = zero;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = std::size_t{1} << axis;
      Lanes low = all(kFar), high = all(-kFar);
      for (std::size_t c = 0; c < 8; ++c) {
        if ((c & step) != 0) continue;
        const Lanes along = hn::Sub(distance[c + step], distance[c]);
        low = hn::Min(low, along);
        high = hn::Max(high, along);
      }
      const Lanes slope = hn::Max(hn::Max(low, hn::Neg(high)), zero);
      missing = hn::Add(missing, hn::Max(hn::Sub(all(cells.edge * cells.edge), hn::Mul(slope, slope)), zero));
    }
    const Lanes squared = hn::Sub(hn::Mul(least, least), hn::Mul(all(0.25F), missing));
    const auto clear = hn::And(hn::Gt(least, all(kHalfOfDiagonal * cells.edge + 1e-5F)), hn::Gt(squared, zero));
    const Lanes dip = hn::Sub(least, hn::Sqrt(hn::Max(squared, zero)));
    hn::StoreU(hn::IfThenElse(clear, hn::Add(hn::Add(above, dip), all(1e-5F)), all(kFar)), cell_lanes, out.data() + i);
  }
  return out;
}

// A linear function for each cell that is nowhere above the distance from a triangle, and at most a unit steep.
struct Floor {
  Places slope;
  Lanes at_centre;
};

// How far the stored values are above a floor, and the floor below 0.
struct AboveFloor {
  Lanes above, below_zero;
};

struct CellLanes {
  Places m;
  Lanes stored[8];
  float half_edge;
};

HWY_INLINE AboveFloor above_floor(const CellLanes& cells, const Floor& floor) {
  const Lanes half = all(cells.half_edge);
  const Lanes x = hn::Mul(floor.slope.x, half), y = hn::Mul(floor.slope.y, half), z = hn::Mul(floor.slope.z, half);
  const Lanes along_x[2] = {hn::Sub(floor.at_centre, x), hn::Add(floor.at_centre, x)};
  const Lanes along_y[4] = {hn::Sub(along_x[0], y), hn::Sub(along_x[1], y), hn::Add(along_x[0], y),
                            hn::Add(along_x[1], y)};
  Lanes above = all(-kFar);
  for (int c = 0; c < 8; ++c) {
    const Lanes at = c < 4 ? hn::Sub(along_y[c], z) : hn::Add(along_y[c - 4], z);
    above = hn::Max(above, hn::Sub(cells.stored[c], at));
  }
  return {above, hn::Sub(length_1(x, y, z), floor.at_centre)};
}

// The triangle's plane, seen from the centre.
HWY_INLINE Floor plane_floor(const ProofTriangle& t, const Places& m) {
  const Lanes height = value(t.plane, m);
  const auto side = [&](float a) { return hn::IfThenElse(hn::Lt(height, hn::Zero(cell_lanes)), all(-a), all(a)); };
  return {{side(t.plane.a), side(t.plane.b), side(t.plane.c)}, hn::Abs(height)};
}

HWY_INLINE Lanes dot(const Places& a, const Places& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

// All of the triangle lies behind the plane along a direction.
HWY_INLINE Floor floor_along(const ProofTriangle& t, const Places& u, const Places& m) {
  const Lanes farthest = hn::Max(hn::Max(dot(u, t.corner[0]), dot(u, t.corner[1])), dot(u, t.corner[2]));
  return {u, hn::Sub(dot(u, m), farthest)};
}

// A little shorter than 1, so that rounding does not make it longer; 0 where the direction is not known.
HWY_INLINE Places shortened(const Places& u, Lanes length, float shortest) {
  const Lanes scale = hn::IfThenElseZero(hn::Gt(length, all(shortest)), hn::Div(all(1 - 1e-5F), length));
  return {hn::Mul(u.x, scale), hn::Mul(u.y, scale), hn::Mul(u.z, scale)};
}

// All of the triangle lies behind the tangent of its distance at the centre.
HWY_INLINE Floor tangent_floor(const ProofTriangle& t, const Places& m) {
  Places from;
  const Lanes length = distance<true>(t, m, from);
  return floor_along(t, shortened(from, length, 1e-3F), m);
}

// The direction in which the stored values grow.
HWY_INLINE Places slope(const CellLanes& cells) {
  Lanes g[3] = {hn::Zero(cell_lanes), hn::Zero(cell_lanes), hn::Zero(cell_lanes)};
  for (int c = 0; c < 8; ++c) {
    for (int axis = 0; axis < 3; ++axis) g[axis] = hn::Add(g[axis], of_corner(c, axis, cells.stored[c]));
  }
  const Places grows{g[0], g[1], g[2]};
  return shortened(grows, hn::Sqrt(dot(grows, grows)), 0.1F);
}

OfCells above_triangles(const ProofTriangle* triangles, std::span<const std::uint32_t> near, const OfCells* distances,
                        const SidedCells& cells) {
  OfCells out;
  for (std::size_t i = 0; i < kCubeCells; i += hn::Lanes(cell_lanes)) {
    CellLanes lanes;
    lanes.m = {hn::Load(cell_lanes, cells.x.data() + i), hn::Load(cell_lanes, cells.y.data() + i),
               hn::Load(cell_lanes, cells.z.data() + i)};
    for (std::size_t c = 0; c < 8; ++c) lanes.stored[c] = hn::Load(cell_lanes, cells.most_stored[c].data() + i);
    lanes.half_edge = cells.edge / 2;
    const Lanes reach = hn::Load(cell_lanes, cells.reach.data() + i);
    const Lanes core = hn::Load(cell_lanes, cells.core.data() + i);
    const Lanes zero = hn::Zero(cell_lanes);
    const Places grows = slope(lanes);
    Lanes most = zero;
    for (const Lanes stored : lanes.stored) most = hn::Max(most, stored);
    const float half = kHalfOfDiagonal * cells.edge;
    Lanes above = zero;
    auto open = hn::Ge(reach, zero);
    for (std::size_t n = 0; n < near.size() && !hn::AllFalse(cell_lanes, open); ++n) {
      const ProofTriangle& t = triangles[near[n]];
      const Lanes d = hn::LoadU(cell_lanes, distances[n].data() + i);
      auto counts = hn::And(open, hn::Le(d, reach));
      // No point of the cell is nearer than this.
      const Lanes nearest = hn::Sub(d, all(half + 2 * t.error));
      const Lanes by_way = hn::Sub(most, nearest);
      const auto far = hn::And(hn::And(counts, hn::Gt(nearest, zero)), hn::Le(by_way, all(kFarShare * cells.enough)));
      above = hn::IfThenElse(far, hn::Max(above, by_way), above);
      counts = hn::AndNot(far, counts);
      if (hn::AllFalse(cell_lanes, counts)) continue;
      // Less the error.
      const Lanes enough = all(cells.enough - 2 * t.error), below = all(-2 * t.error);
      AboveFloor found = above_floor(lanes, plane_floor(t, lanes.m));
      const auto better = [&](auto where, const Floor& floor) HWY_ATTR {
        const AboveFloor other = above_floor(lanes, floor);
        found.above = hn::IfThenElse(where, hn::Min(found.above, other.above), found.above);
        found.below_zero = hn::IfThenElse(where, hn::Min(found.below_zero, other.below_zero), found.below_zero);
      };
      const auto unclear = hn::And(counts, hn::Or(hn::Gt(found.above, enough), hn::Ge(found.below_zero, below)));
      if (!hn::AllFalse(cell_lanes, unclear)) {
        better(unclear, tangent_floor(t, lanes.m));
        const auto high = hn::And(unclear, hn::Gt(found.above, enough));
        if (!hn::AllFalse(cell_lanes, high)) better(high, floor_along(t, grows, lanes.m));
      }
      const auto in_core = hn::And(counts, hn::Le(hn::Sub(below, found.below_zero), core));
      above = hn::IfThenElse(in_core, hn::Max(above, hn::Add(found.above, all(2 * t.error))), above);
      open =
          hn::AndNot(hn::Or(hn::And(counts, hn::Ge(found.below_zero, below)), hn::Gt(above, all(cells.enough))), open);
    }
    hn::StoreU(hn::IfThenElse(open, above, all(kFar)), cell_lanes, out.data() + i);
  }
  return out;
}

float below_triangle(const ProofTriangle& t, const SidedCell& cell) {
  const float* const least = cell.least_stored.data();
  return largest_at_corners(t, cell.centre.data(), cell.edge,
                            [&](Lanes d, std::size_t i)
                                HWY_ATTR { return hn::Sub(d, hn::Load(cell_lanes, least + i)); }) +
         2 * t.error;
}

}  // namespace vps::bake::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::bake {
namespace detail {
HWY_EXPORT(by_samples);
HWY_EXPORT(by_plane);
HWY_EXPORT(by_nothing);
HWY_EXPORT(above_triangles);
HWY_EXPORT(below_triangle);
}  // namespace detail

OfCells prove_by_samples(const SheetCells& cells, const std::array<OfCells, kCubeCells>& exact) {
  using namespace detail;  // Highway's macros take names without a namespace
  return HWY_DYNAMIC_DISPATCH(by_samples)(cells, exact);
}

void prove_by_plane(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                    std::span<OfCells> distances) {
  using namespace detail;
  HWY_DYNAMIC_DISPATCH(by_plane)(triangles.data(), near, cells, distances.data());
}

void measure_cells(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near, SheetCells& cells,
                   std::span<OfCells> distances) {
  using namespace detail;
  HWY_DYNAMIC_DISPATCH(by_nothing)(triangles.data(), near, cells, distances.data());
}

OfCells prove_above(std::span<const ProofTriangle> triangles, std::span<const std::uint32_t> near,
                    std::span<const OfCells> distances, const SidedCells& cells) {
  using namespace detail;
  return HWY_DYNAMIC_DISPATCH(above_triangles)(triangles.data(), near, distances.data(), cells);
}

float prove_below(const ProofTriangle& triangle, const SidedCell& cell) {
  using namespace detail;
  return HWY_DYNAMIC_DISPATCH(below_triangle)(triangle, cell);
}

}  // namespace vps::bake
#endif
