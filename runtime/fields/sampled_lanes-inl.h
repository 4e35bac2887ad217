// SPDX-License-Identifier: Zlib
/// @file A sampled field in vector lanes, compiled once per instruction set. Internal: see field_lanes-inl.h.
#if defined(VPS_RUNTIME_SAMPLED_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef VPS_RUNTIME_SAMPLED_LANES_INL_H_
#undef VPS_RUNTIME_SAMPLED_LANES_INL_H_
#else
#define VPS_RUNTIME_SAMPLED_LANES_INL_H_
#endif

#include <algorithm>
#include <cmath>
#include <limits>

#include <hwy/cache_control.h>

#include "runtime/fields/field_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

template <class Integer>
struct SampledLanes : Everywhere {
  static constexpr bool kHasFarGrid = true;
  const SampledMap& map;

  struct Looked {
    F value;  // V where `sampled`
    F cell;   // edge of the cell there
    M sampled;
    M far_inside;  // beyond the band, inside
    Points grid;   // the point; 0 beyond the grid
    M in_grid;
  };

  // 2^exponent: the edge of a field brick's cells by its level, or its inverse.
  static HWY_INLINE F power_of_two(I exponent) {
    return hn::BitCast(f32, hn::ShiftLeft<23>(hn::Add(exponent, hn::Set(i32, 127))));
  }

  static HWY_INLINE F low_half(I pair) {
    constexpr int kBits = 32 - 8 * static_cast<int>(sizeof(Integer));
    return hn::ConvertTo(f32, hn::ShiftRight<kBits>(hn::ShiftLeft<kBits>(pair)));
  }
  static HWY_INLINE F high_half(I pair) {
    constexpr int kUp = 32 - 16 * static_cast<int>(sizeof(Integer));
    constexpr int kDown = 32 - 8 * static_cast<int>(sizeof(Integer));
    return hn::ConvertTo(f32, hn::ShiftRight<kDown>(hn::ShiftLeft<kUp>(pair)));
  }

  // On the way down the octree: octree::find_entry in lanes.
  struct Walk {
    Points grid;
    M in_grid;
    I ix, iy, iz;
    I entry;
  };
  HWY_INLINE Walk begin(const Points& p) const {
    const Voxels voxel = voxels_of(p);
    const M in_grid = in_grid_at(voxel);
    const I root = root_of(voxel, in_grid);
    const Points grid = {hn::IfThenElseZero(in_grid, p.x), hn::IfThenElseZero(in_grid, p.y),
                         hn::IfThenElseZero(in_grid, p.z)};
    return {grid, in_grid, voxel.x, voxel.y, voxel.z, entry_of(root)};
  }
  // The integer of a whole number below 2^22. Others, and NaN, give numbers from 2^22 on, as unsigned ones. Adding
  // 1.5 * 2^23 to a whole number leaves it in the last bits; Highway's ConvertTo also handles overflow, in three steps.
  static HWY_INLINE I integer_of(F whole) {
    constexpr float kLarge = 12582912;
    return hn::Sub(hn::BitCast(i32, hn::Add(whole, set(kLarge))), hn::BitCast(i32, set(kLarge)));
  }
  // The lowest corner of the cell of voxel centres around a point.
  struct Voxels {
    I x, y, z;
  };
  static HWY_INLINE Voxels voxels_of(const Points& p) {
    return {integer_of(hn::Floor(p.x)), integer_of(hn::Floor(p.y)), integer_of(hn::Floor(p.z))};
  }
  HWY_INLINE M in_grid_at(const Voxels& voxel) const { return are_below(voxel.x, voxel.y, voxel.z, map.cells); }
  // The root of a voxel's block; of the first one beyond the grid.
  HWY_INLINE I root_of(const Voxels& voxel, M in_grid) const {
    static_assert(kRootCells == 16);
    const I at = root_at(hn::ShiftRight<4>(voxel.x), hn::ShiftRight<4>(voxel.y), hn::ShiftRight<4>(voxel.z));
    return hn::GatherIndex(i32, map.roots, hn::IfThenElseZero(hn::RebindMask(i32, in_grid), at));
  }
  // Position of a block in `roots` and `coarse_layers`.
  HWY_INLINE I root_at(I x, I y, I z) const {
    const I row = hn::Add(hn::Mul(z, hn::Set(i32, map.root_dims[1])), y);
    return hn::Add(hn::Mul(row, hn::Set(i32, map.root_dims[0])), x);
  }
  // octree::root_entry in lanes.
  static HWY_INLINE I entry_of(I root) {
    static_assert(kInsideFlag == 1U << 30);
    const I none = hn::Sub(hn::Set(i32, -1), hn::ShiftRight<30>(root));  // kFarOutside or kFarInside
    return hn::IfThenElse(hn::Lt(root, hn::Zero(i32)), root, none);
  }

  // Descends from octants of 2^kShift cells.
  template <int kShift>
  HWY_INLINE void go_down(Walk& walk) const {
    if (hn::AllFalse(i32, is_node(walk.entry))) return;
    enter<kShift>(walk);
    if constexpr (kShift > 0) go_down<kShift - 1>(walk);
  }
  // octree::is_node for signed numbers: nodes lie below -2 and -1, the two codes of no brick. Bricks lie from 0 on.
  static HWY_INLINE auto is_node(I entry) { return hn::Lt(entry, hn::Set(i32, static_cast<std::int32_t>(kFarInside))); }
  template <int kShift>
  HWY_INLINE void enter(Walk& walk) const {
    const I one = hn::Set(i32, 1);
    const auto node = is_node(walk.entry);
    const I octant = hn::Or(hn::Or(hn::And(hn::ShiftRight<kShift>(walk.ix), one),
                                   hn::ShiftLeft<1>(hn::And(hn::ShiftRight<kShift>(walk.iy), one))),
                            hn::ShiftLeft<2>(hn::And(hn::ShiftRight<kShift>(walk.iz), one)));
    const I number = hn::And(walk.entry, hn::Set(i32, static_cast<std::int32_t>(~kNodeFlag)));
    const I at = hn::IfThenElseZero(node, hn::Add(hn::ShiftLeft<3>(number), octant));
    walk.entry = hn::IfThenElse(node, hn::GatherIndex(i32, map.nodes, at), walk.entry);
  }

  // The eight samples around each point.
  struct Cells {
    Looked looked;  // without values
    I first;        // of the first sample, in `values`. [bytes]
    F fx, fy, fz;   // the point's place in the cell, from 0 to 1; z is the axis of the slices
    F step;         // between the samples' numbers
  };
  HWY_INLINE Cells find_cells(const Points& p) const {
    Walk walk = begin(p);
    go_down<3>(walk);
    return cells_of(walk);
  }
  HWY_INLINE Cells cells_of(const Walk& walk) const {
    const I no_brick = hn::Set(i32, static_cast<std::int32_t>(kFarInside));
    const auto is_brick = hn::Gt(walk.entry, hn::Set(i32, -1));
    Cells out;
    out.looked.sampled = hn::And(walk.in_grid, hn::RebindMask(f32, is_brick));
    out.looked.far_inside = hn::And(walk.in_grid, hn::RebindMask(f32, hn::Eq(walk.entry, no_brick)));
    out.looked.grid = walk.grid;
    out.looked.in_grid = walk.in_grid;

    const I entry = hn::IfThenElseZero(is_brick, walk.entry);
    const I level = hn::ShiftRight<kLevelShift>(entry);
    out.looked.cell = power_of_two(hn::Add(level, hn::Set(i32, kFinestLevel)));
    const M coarse = hn::RebindMask(f32, hn::Eq(level, hn::Set(i32, kCoarsestLevel - kFinestLevel)));
    out.step = hn::IfThenElse(coarse, set(2 * map.step), set(map.step));
    // In cells from the brick's lowest corner.
    static_assert(kFieldEdge == 5, "a brick has four cells along its edge");
    const F per_brick = power_of_two(hn::Sub(hn::Set(i32, -kFinestLevel - 2), level));
    const auto in_brick = [&](F a) {
      const F bricks = hn::Mul(a, per_brick);
      return hn::Mul(hn::Sub(bricks, hn::Floor(bricks)), set(kFieldEdge - 1));
    };
    F x = in_brick(walk.grid.x);
    F y = in_brick(walk.grid.y);
    F z = in_brick(walk.grid.z);
    // octree::corners_of in lanes.
    const auto has = [&](int bit) { return hn::RebindMask(f32, hn::TestBit(entry, hn::Set(i32, 1 << bit))); };
    const M along_y = has(kAxisShift);
    const M along_x = has(kAxisShift + 1);
    const F across = z;
    z = hn::IfThenElse(along_y, y, hn::IfThenElse(along_x, x, z));
    y = hn::IfThenElse(along_y, across, y);
    x = hn::IfThenElse(along_x, across, x);
    const I left_out = hn::And(hn::ShiftRight<kLeftOutShift>(entry), hn::Set(i32, 3));
    const F left_out_f = hn::ConvertTo(f32, left_out);
    z = hn::Max(hn::Sub(z, hn::IfThenElseZero(has(kLowerEndShift), left_out_f)), hn::Zero(f32));
    z = hn::Min(z, hn::Sub(set(kFieldEdge - 1), left_out_f));
    const F cell_x = hn::Floor(x);
    const F cell_y = hn::Floor(y);
    const F cell_z = hn::Min(hn::Floor(z), hn::Sub(set(kFieldEdge - 2), left_out_f));
    out.fx = hn::Sub(x, cell_x);
    out.fy = hn::Sub(y, cell_y);
    out.fz = hn::Sub(z, cell_z);
    const I lx = integer_of(cell_x);
    const I ly = integer_of(cell_y);
    const I lz = integer_of(cell_z);
    const I slice = hn::Add(hn::And(entry, hn::Set(i32, kNumberMask)), lz);
    const I row = hn::Add(hn::Add(hn::ShiftLeft<2>(slice), slice), ly);
    const I sample = hn::Add(hn::Add(hn::ShiftLeft<2>(row), row), lx);
    constexpr int kBytesLog2 = sizeof(Integer) == 1 ? 0 : 1;
    out.first = hn::ShiftLeft<kBytesLog2>(sample);
    return out;
  }

  // Asks memory for the samples.
  HWY_INLINE void fetch(const Cells& cells) const {
    HWY_ALIGN std::int32_t first[kLanePadding];
    hn::Store(cells.first, i32, first);
    const auto* const bytes = static_cast<const std::uint8_t*>(map.values);
    constexpr std::size_t kLast = (kFieldEdge * kFieldEdge + kFieldEdge + 1) * sizeof(Integer);
    for (std::size_t lane = 0; lane < hn::Lanes(i32); ++lane) {
      hwy::Prefetch(bytes + first[lane]);
      hwy::Prefetch(bytes + first[lane] + kLast);
    }
  }

  HWY_INLINE Looked interpolate(const Cells& cells) const {
    const auto* const bytes = static_cast<const std::uint8_t*>(map.values);
    const auto pair_at = [&](std::size_t samples) {
      return hn::GatherOffset(i32, reinterpret_cast<const std::int32_t*>(bytes + samples * sizeof(Integer)),
                              cells.first);
    };
    const auto along_x = [&](I pair) {
      const F low = low_half(pair);
      return hn::MulAdd(cells.fx, hn::Sub(high_half(pair), low), low);
    };
    const F v00 = along_x(pair_at(0));
    const F v10 = along_x(pair_at(kFieldEdge));
    const F v01 = along_x(pair_at(kFieldEdge * kFieldEdge));
    const F v11 = along_x(pair_at(kFieldEdge * kFieldEdge + kFieldEdge));
    const F v0 = hn::MulAdd(cells.fy, hn::Sub(v10, v00), v00);
    const F v1 = hn::MulAdd(cells.fy, hn::Sub(v11, v01), v01);
    Looked out = cells.looked;
    out.value = hn::Mul(hn::MulAdd(cells.fz, hn::Sub(v1, v0), v0), cells.step);
    return out;
  }

  HWY_INLINE Looked look_up(const Points& p) const { return interpolate(find_cells(p)); }

  // How far a point can move before V may have grown by `gap`, as far as its brick reaches: docs/internals/bounds.md,
  // "Lists of points". 0 where there are no samples.
  // @param jump  most by which the errors of two samples differ
  static HWY_INLINE F way_in_brick(const Looked& found, F gap, float jump) {
    const F edge = hn::Mul(found.cell, set(kFieldEdge - 1));
    const auto along = [&](F a) {
      const F begin = hn::Mul(hn::Floor(hn::Div(a, edge)), edge);
      return hn::Min(hn::Sub(a, begin), hn::Sub(hn::Add(begin, edge), a));
    };
    const F within = hn::Min(hn::Min(along(found.grid.x), along(found.grid.y)), along(found.grid.z));
    const F steepest = hn::Mul(set(std::sqrt(3.0F)), hn::Add(set(1), hn::Div(set(jump), found.cell)));
    return hn::IfThenElseZero(found.sampled, hn::Min(hn::Div(gap, steepest), within));
  }

  static HWY_INLINE F square(F a) { return hn::Mul(a, a); }

  // Bounds that a block's coarse layer gives for a point of the grid: |layers| - reach <= |V| < |layers| +
  // kCoarseLayerSlack + reach.
  struct Coarse {
    F layers, reach;
  };
  HWY_INLINE Coarse coarse_at(const Points& g) const {
    const F half = set(0.5F);
    const auto [vx, vy, vz] = voxels_of({hn::Add(g.x, half), hn::Add(g.y, half), hn::Add(g.z, half)});
    static_assert(kCoarseEdge == 16);
    const I block = root_at(hn::ShiftRight<4>(vx), hn::ShiftRight<4>(vy), hn::ShiftRight<4>(vz));
    // A word has two layers. All words lie in the file, which was checked.
    const I pair =
        hn::GatherIndex(i32, reinterpret_cast<const std::int32_t*>(map.coarse_layers), hn::ShiftRight<1>(block));
    const I odd = hn::And(block, hn::Set(i32, 1));
    const I low = hn::ShiftRight<16>(hn::ShiftLeft<16>(pair));
    const F layers =
        hn::Abs(hn::ConvertTo(f32, hn::IfThenElse(hn::Eq(odd, hn::Zero(i32)), low, hn::ShiftRight<16>(pair))));
    const auto from_centre = [&](F at, I v) {
      const F first = hn::ConvertTo(f32, hn::ShiftLeft<4>(hn::ShiftRight<4>(v)));
      return square(hn::Sub(at, hn::Add(first, set(0.5F * (kCoarseEdge - 1)))));
    };
    return {layers, hn::Sqrt(hn::Add(hn::Add(from_centre(g.x, vx), from_centre(g.y, vy)), from_centre(g.z, vz)))};
  }

  // Lower bound of the distance beyond the band: the band's end less the distance to the voxel's centre. The centre
  // decides whether a voxel lies beyond the band.
  HWY_INLINE F least_beyond(const Looked& found) const {
    const F half = set(0.5F);
    const auto from_voxel = [&](F g) { return square(hn::Sub(g, hn::Floor(hn::Add(g, half)))); };
    const F slack =
        hn::Sqrt(hn::Add(hn::Add(from_voxel(found.grid.x), from_voxel(found.grid.y)), from_voxel(found.grid.z)));
    return hn::Sub(hn::IfThenElse(found.far_inside, set(map.band_inner), set(map.band_outer)), slack);
  }

  HWY_INLINE F to_bounds(const Points& p) const {
    const auto gap = [&](F a, int axis) {
      return hn::Max(hn::Max(hn::Sub(set(map.bounds_min[axis]), a), hn::Sub(a, set(map.bounds_max[axis]))),
                     hn::Zero(f32));
    };
    return hn::Sqrt(hn::Add(hn::Add(square(gap(p.x, 0)), square(gap(p.y, 1))), square(gap(p.z, 2))));
  }

  // Lower bound of the distance where there are no samples: from the mesh's bounds and, in the grid, from the coarse
  // layers, as far_interval.
  HWY_NOINLINE F far_distance(const Points& p, const Looked& found) const {
    const Coarse coarse = coarse_at(found.grid);
    const F known = hn::Max(hn::Sub(coarse.layers, coarse.reach), least_beyond(found));
    const F in_grid_distance = hn::Max(known, hn::Zero(f32));
    const F bounds = to_bounds(p);
    const F outside = hn::IfThenElse(found.in_grid, hn::Max(bounds, in_grid_distance), bounds);
    return hn::IfThenElse(found.far_inside, in_grid_distance, outside);
  }
  HWY_INLINE F far(const Points& p, const Looked& found) const {
    return hn::AllTrue(f32, found.sampled) ? hn::Zero(f32) : far_distance(p, found);
  }

  // V, but beyond the band only a value that is no farther from 0 than the true V.
  HWY_INLINE F value_of(const Points& p, const Looked& found) const {
    const F distance = far(p, found);
    const F beyond = hn::IfThenElse(found.far_inside, distance, hn::Neg(distance));
    return hn::IfThenElse(found.sampled, found.value, beyond);
  }

  // Where value_of is not V: the field's own values may be clamped there.
  HWY_INLINE M beyond_band(F v) const { return hn::Or(hn::Ge(v, set(map.end_inner)), hn::Le(v, set(-map.end_outer))); }
  // V in these lanes, from the far grid: voxelmap_penetration in lanes.
  HWY_NOINLINE F with_far_grid(const Points& p, F known, M sampled) const {
    const Far far = far_at(p);
    const F zero = hn::Zero(f32);
    const M inside = hn::Ge(known, zero);
    const F farther = hn::IfThenElse(inside, hn::Max(known, far.value), hn::Min(known, far.value));
    const F end = hn::IfThenElse(inside, set(map.end_inner), set(map.end_outer));
    const F band = hn::IfThenElse(inside, set(map.band_inner), set(map.band_outer));
    const F into = hn::Div(hn::Sub(hn::Abs(known), end), hn::Sub(band, end));
    const F weight = hn::IfThenElse(sampled, hn::Min(hn::Max(into, zero), set(1)), set(1));
    const F v = hn::MulAdd(weight, hn::Sub(farther, known), known);
    return hn::IfThenElse(hn::And(far.in_grid, beyond_band(known)), v, known);
  }
  struct Far {
    F value;
    M in_grid;
  };
  HWY_INLINE Far far_at(const Points& p) const {
    const auto place = [&](F a, int axis) {
      return hn::Mul(hn::Sub(a, set(map.far_origin[axis])), set(map.far_per_voxel));
    };
    const F ax = place(p.x, 0);
    const F ay = place(p.y, 1);
    const F az = place(p.z, 2);
    const auto within = [&](F a, int axis) {
      return hn::And(hn::Ge(a, hn::Zero(f32)), hn::Lt(a, set(map.far_top[axis])));
    };
    const M in_grid = hn::And(within(ax, 0), hn::And(within(ay, 1), within(az, 2)));
    const auto lower = [&](F a) { return hn::Floor(hn::IfThenElseZero(in_grid, a)); };
    const F lx = lower(ax);
    const F ly = lower(ay);
    const F lz = lower(az);
    const F fx = hn::Sub(ax, lx);
    const F fy = hn::Sub(ay, ly);
    const F fz = hn::Sub(az, lz);
    const I nx = hn::Set(i32, map.far_dims[0]);
    const I row = hn::Add(hn::Mul(integer_of(lz), hn::Set(i32, map.far_dims[1])), integer_of(ly));
    const I node = hn::Add(hn::Mul(row, nx), integer_of(lx));
    const I above = hn::Add(node, hn::Mul(nx, hn::Set(i32, map.far_dims[1])));
    // Words of four values, of which two are used. All words lie in the file, which was checked.
    const auto* const words = reinterpret_cast<const std::int32_t*>(map.far);
    const auto metric = [&](I q) {
      const F v = hn::ConvertTo(f32, q);
      return hn::Mul(v, hn::IfThenElse(hn::Gt(v, hn::Zero(f32)), set(map.far_step_inner), set(map.far_step_outer)));
    };
    const auto along_x = [&](I at) {
      const I word = hn::GatherOffset(i32, words, at);
      const F low = metric(hn::ShiftRight<24>(hn::ShiftLeft<24>(word)));
      const F high = metric(hn::ShiftRight<24>(hn::ShiftLeft<16>(word)));
      return hn::MulAdd(fx, hn::Sub(high, low), low);
    };
    const F v00 = along_x(node);
    const F v10 = along_x(hn::Add(node, nx));
    const F v01 = along_x(above);
    const F v11 = along_x(hn::Add(above, nx));
    const F v0 = hn::MulAdd(fy, hn::Sub(v10, v00), v00);
    const F v1 = hn::MulAdd(fy, hn::Sub(v11, v01), v01);
    return {hn::MulAdd(fz, hn::Sub(v1, v0), v0), in_grid};
  }

  struct Ceiling {
    F v;
    M wide;
  };
  // Upper bound of V at points outside, no less than 0 inside: from the planes, and beyond the grid from the mesh's
  // bounds. docs/internals/bounds.md, "The planes". find_plane in lanes.
  HWY_INLINE Ceiling ceiling(const Points& p) const {
    const Voxels voxel = voxels_of(p);
    const M in_grid = in_grid_at(voxel);
    const I root = root_of(voxel, in_grid);
    // octree::has_octant_planes
    constexpr auto kEither = static_cast<std::int32_t>(kNodeFlag | kOctantsFlag);
    const auto of_block = hn::Eq(hn::And(root, hn::Set(i32, kEither)), hn::Zero(i32));
    static_assert(kPlaneCell == 8 && kRootCells == 16);
    const auto bit = [](I v, int number) { return hn::And(v, hn::Set(i32, number)); };
    const I octant = hn::Or(hn::Or(bit(hn::ShiftRight<3>(voxel.x), 1), bit(hn::ShiftRight<2>(voxel.y), 2)),
                            bit(hn::ShiftRight<1>(voxel.z), 4));
    const I at = hn::Or(hn::ShiftLeft<3>(root), octant);  // the flags are shifted out
    const I planes = hn::GatherIndex(i32, map.planes, hn::IfThenZeroElse(of_block, at));
    const I code = hn::IfThenElse(of_block, root, planes);
    // plane_height, of decode_plane or decode_block
    const I up = hn::ShiftRight<22>(hn::IfThenElse(of_block, hn::ShiftLeft<3>(code), hn::ShiftLeft<1>(code)));
    const F size = hn::ConvertTo(f32, hn::IfThenElse(of_block, hn::And(up, hn::Set(i32, ~3)), up));
    const F height = hn::Mul(hn::Mul(size, hn::Abs(size)), set(1.0F / kHeightSquares));
    // height_at
    const I corner = hn::IfThenElse(of_block, hn::Set(i32, ~15), hn::Set(i32, ~7));
    const I half = hn::IfThenElse(of_block, hn::Set(i32, 8), hn::Set(i32, 4));
    const auto from_centre = [&](F a, I v) { return hn::Sub(a, hn::ConvertTo(f32, hn::OrAnd(half, v, corner))); };
    const auto slope = [&](I shifted) { return hn::ConvertTo(f32, hn::ShiftRight<25>(shifted)); };
    F rise = hn::Mul(slope(hn::ShiftLeft<25>(code)), from_centre(p.x, voxel.x));
    rise = hn::MulAdd(slope(hn::ShiftLeft<18>(code)), from_centre(p.y, voxel.y), rise);
    rise = hn::MulAdd(slope(hn::ShiftLeft<11>(code)), from_centre(p.z, voxel.z), rise);
    Ceiling out{hn::MulAdd(rise, set(1.0F / kSlopeSteps), height),
                hn::And(in_grid, hn::RebindMask(f32, hn::Lt(code, hn::Zero(i32))))};
    if (!hn::AllTrue(f32, in_grid)) out.v = hn::IfThenElse(in_grid, out.v, hn::Neg(to_bounds(p)));
    return out;
  }

  // Where the true distance is at most `reach`, the interpolated one is at most reach + slack: see least_distance.
  HWY_INLINE F bound(const Points& p, F reach) const { return bound_of(p, reach, look_up(p)); }
  HWY_INLINE F bound_of(const Points& p, F reach, const Looked& found) const {
    const F squared = hn::MulAdd(reach, reach, hn::Mul(set(kHalfDiagonalSquared), hn::Mul(found.cell, found.cell)));
    const F slack = hn::Sub(hn::Sqrt(squared), reach);
    const F beyond =
        hn::IfThenElse(found.far_inside, set(std::numeric_limits<float>::max() / 2), hn::Neg(far(p, found)));
    return hn::IfThenElse(found.sampled, hn::Add(found.value, slack), beyond);
  }

  // `highest` as penetration_interval's upper end.
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch&, M valid) const {
    const Looked found = look_up(p);
    const M certified = hn::And(found.sampled, hn::And(hn::Gt(found.value, set(-map.certified_outer)),
                                                       hn::Lt(found.value, set(map.certified_inner))));
    if (hn::AllFalse(f32, hn::AndNot(certified, valid))) return {found.value, found.value};
    const Penetrations beyond = penetrations_beyond(p, found);
    F v = hn::IfThenElse(found.sampled, found.value, beyond.value);
    F highest = beyond.highest;
    if (map.far != nullptr) {
      v = with_far_grid(p, v, found.sampled);
      highest = hn::Min(highest, far_highest(p));
    }
    return {v, hn::IfThenElse(certified, found.value, highest)};
  }
  // Upper end of within_far_grid; the field's error is left out as in `highest`.
  HWY_INLINE F far_highest(const Points& p) const {
    const Far far = far_at(p);
    const float h = 1 / map.far_per_voxel;
    const F least = hn::Sub(hn::Neg(far.value), set(0.5F * std::max(map.far_step_inner, map.far_step_outer)));
    const F squared = hn::Sub(square(least), set(kHalfDiagonalSquared * h * h));
    const F near = hn::Sub(least, set(std::sqrt(kHalfDiagonalSquared) * h));
    const M is_far = hn::And(hn::Gt(least, hn::Zero(f32)), hn::Gt(squared, hn::Zero(f32)));
    const F distance = hn::IfThenElse(is_far, hn::Sqrt(squared), near);
    return hn::IfThenElse(far.in_grid, hn::Neg(distance), set(std::numeric_limits<float>::max()));
  }
  HWY_NOINLINE Penetrations penetrations_beyond(const Points& p, const Looked& found) const {
    const F zero = hn::Zero(f32);
    // For a point beyond the grid: the nearest point in it. The angle there to any point of the grid is at least a
    // right one.
    const auto clamped = [&](F a, int axis) { return hn::Min(hn::Max(a, zero), set(map.top[axis])); };
    const Points nearest = {clamped(p.x, 0), clamped(p.y, 1), clamped(p.z, 2)};
    const Coarse coarse = coarse_at(nearest);
    const F gap_squared = hn::Add(hn::Add(square(hn::Sub(p.x, nearest.x)), square(hn::Sub(p.y, nearest.y))),
                                  square(hn::Sub(p.z, nearest.z)));
    const F least_coarse = hn::Max(hn::Sub(coarse.layers, coarse.reach), zero);
    const F least = hn::Max(to_bounds(p), hn::Sqrt(hn::MulAdd(least_coarse, least_coarse, gap_squared)));
    const F unsampled = hn::IfThenElse(found.in_grid, hn::Max(least, least_beyond(found)), least);

    const F interpolated = hn::Sub(hn::Neg(found.value), set(map.error));
    const F squared = hn::Sub(square(interpolated), hn::Mul(set(kHalfDiagonalSquared), square(found.cell)));
    const F near = hn::Sub(interpolated, hn::Mul(set(std::sqrt(kHalfDiagonalSquared)), found.cell));
    const M is_far = hn::And(hn::Gt(interpolated, zero), hn::Gt(squared, zero));
    const F of_samples = hn::IfThenElse(is_far, hn::Sqrt(squared), near);
    const F sampled = hn::Max(of_samples, set(map.certified_outer));

    const M inside = hn::Or(found.far_inside, hn::And(found.sampled, hn::Ge(found.value, zero)));
    const F distance = hn::IfThenElse(found.sampled, sampled, unsampled);
    const F most = hn::Add(coarse.layers, hn::Add(coarse.reach, set(kCoarseLayerSlack)));
    return {hn::IfThenElse(inside, unsampled, hn::Neg(unsampled)), hn::IfThenElse(inside, most, hn::Neg(distance))};
  }
};

// Two walks side by side: each has up to five reads, one after the other, and the reads of one fill the waits of the
// other.
template <int kShift, class Lanes>
HWY_INLINE void go_down_together(const Lanes& a, typename Lanes::Walk& in_a, const Lanes& b,
                                 typename Lanes::Walk& in_b) {
  if (hn::AllFalse(i32, hn::Or(Lanes::is_node(in_a.entry), Lanes::is_node(in_b.entry)))) return;
  a.template enter<kShift>(in_a);
  b.template enter<kShift>(in_b);
  if constexpr (kShift > 0) go_down_together<kShift - 1>(a, in_a, b, in_b);
}
// The cells around points in two maps, or in one.
template <class Lanes>
HWY_INLINE void find_cells_together(const Lanes& a, const Points& in_a, const Lanes& b, const Points& in_b,
                                    typename Lanes::Cells& of_a, typename Lanes::Cells& of_b) {
  typename Lanes::Walk walk_a = a.begin(in_a);
  typename Lanes::Walk walk_b = b.begin(in_b);
  go_down_together<3>(a, walk_a, b, walk_b);
  of_a = a.cells_of(walk_a);
  of_b = b.cells_of(walk_b);
}

HWY_INLINE SampledLanes<std::int8_t> lanes_of(const SampledMap8& field, const PointshellView&) {
  return {{}, field};
}
HWY_INLINE SampledLanes<std::int16_t> lanes_of(const SampledMap16& field, const PointshellView&) {
  return {{}, field};
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // toggled guard
