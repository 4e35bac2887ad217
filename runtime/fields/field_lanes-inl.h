// SPDX-License-Identifier: Zlib
/// @file Fields and rows of the tree in vector lanes, compiled once per instruction set. Internal. Highway includes a
/// source again for each instruction set (`hwy/foreach_target.h`); the guard of this header toggles each time.
#if defined(VPS_RUNTIME_FIELD_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef VPS_RUNTIME_FIELD_LANES_INL_H_
#undef VPS_RUNTIME_FIELD_LANES_INL_H_
#else
#define VPS_RUNTIME_FIELD_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <bit>
#include <cstring>
#include <limits>
#include <type_traits>

#include "runtime/fields/place_field.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kLanePadding>;
using Ints = hn::Rebind<std::int32_t, Floats>;
using Words = hn::Rebind<std::uint32_t, Floats>;
using F = hn::Vec<Floats>;
using I = hn::Vec<Ints>;
using M = hn::Mask<Floats>;
constexpr Floats f32;
constexpr Ints i32;

// Packs the lanes of a mask at `to`, which has room for a whole vector. Not CompressStore: some processors take a
// hundred cycles to compress into memory. Nor Compress without AVX-512: it copies a table of 1 KB each time (gcc 12).
// @return how many there are
template <class D>
HWY_INLINE std::uint32_t store_packed(D d, hn::Vec<D> v, hn::Mask<D> mask, hn::TFromD<D>* to) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  std::uint8_t bits[8];
  hn::StoreMaskBits(d, mask, bits);
  const hn::Rebind<std::uint8_t, D> bytes;
  const auto lanes = hn::PromoteTo(hn::Rebind<std::int32_t, D>(), hn::LoadU(bytes, kLanesOfMask[bits[0]].data()));
  hn::StoreU(hn::TableLookupLanes(v, hn::IndicesFromVec(d, lanes)), d, to);
#else
  hn::StoreU(hn::Compress(v, mask), d, to);
#endif
  return static_cast<std::uint32_t>(hn::CountTrue(d, mask));
}

// first, first + 1, ... Iota would store each number alone, and then wait for all.
HWY_INLINE hn::Vec<Words> numbers_from(std::uint32_t first) {
  static_assert(kLanePadding == 16);
  HWY_ALIGN static constexpr std::uint32_t kNumbers[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  const Words u32;
  return hn::Add(hn::Load(u32, kNumbers), hn::Set(u32, first));
}

// Whether all three are below their end, as unsigned numbers.
HWY_INLINE M are_below(I x, I y, I z, const std::uint32_t (&ends)[3]) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_SSE4 || HWY_TARGET == HWY_SSSE3
  // These have no unsigned comparison. The sign of `beyond` is set where a number is negative or too large.
  const auto beyond_end = [&](I a, int axis) {
    return hn::Or(a, hn::Sub(hn::Set(i32, static_cast<std::int32_t>(ends[axis]) - 1), a));
  };
  const I beyond = hn::Or(hn::Or(beyond_end(x, 0), beyond_end(y, 1)), beyond_end(z, 2));
  return hn::RebindMask(f32, hn::Gt(beyond, hn::Set(i32, -1)));
#else
  const Words u32;
  const auto below = [&](I a, int axis) { return hn::Lt(hn::BitCast(u32, a), hn::Set(u32, ends[axis])); };
  return hn::RebindMask(f32, hn::And(hn::And(below(x, 0), below(y, 1)), below(z, 2)));
#endif
}

struct Points {
  F x, y, z;
};

HWY_INLINE F set(float value) {
  return hn::Set(f32, value);
}

// One row of Affine.
HWY_INLINE F row(const Affine& a, int r, const Points& p) {
  const float* const m = a.rotation + 3 * r;
  return hn::MulAdd(set(m[0]), p.x, hn::MulAdd(set(m[1]), p.y, hn::MulAdd(set(m[2]), p.z, set(a.translation[r]))));
}

// Consecutive nodes or points of one parent, at most as many as a vector has lanes.
struct Batch {
  std::uint32_t first = 0, count = 0, parent = 0;
};
HWY_INLINE hn::Vec<Words> numbers_of(const Batch& batch) {
  return numbers_from(batch.first);
}
HWY_INLINE M valid_lanes(const Batch& batch) {
  return hn::FirstN(f32, batch.count);
}

// V at points (for PlainMap a lower bound of the true V), and an upper bound of the true V less the field's error. Both
// are the same in the certified band of a sampled field and in analytic fields.
struct Penetrations {
  F value, highest;
};

struct Everywhere {
  static constexpr bool kHasFarGrid = false;
  struct Cells {};  // of samples
  static HWY_INLINE Points place(const Affine& a, const Points& p) {
    return {row(a, 0, p), row(a, 1, p), row(a, 2, p)};
  }
};

// Each of these has value(), which is V, and bound() for sphere tests: bound + reach >= 0 wherever the true V + reach
// is.
struct BoxLanes : Everywhere {
  const BoxField& box;
  HWY_INLINE F value(const Points& p, const Batch&, M) const {
    const F zero = hn::Zero(f32);
    const F qx = hn::Sub(hn::Abs(p.x), set(box.half_extents.x));
    const F qy = hn::Sub(hn::Abs(p.y), set(box.half_extents.y));
    const F qz = hn::Sub(hn::Abs(p.z), set(box.half_extents.z));
    const F ox = hn::Max(qx, zero);
    const F oy = hn::Max(qy, zero);
    const F oz = hn::Max(qz, zero);
    const F outside = hn::Sqrt(hn::MulAdd(ox, ox, hn::MulAdd(oy, oy, hn::Mul(oz, oz))));
    return hn::Neg(hn::Add(outside, hn::Min(hn::Max(qx, hn::Max(qy, qz)), zero)));
  }
  HWY_INLINE F bound(const Points& p, F) const { return value(p, Batch(), M()); }
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch& batch, M valid) const {
    const F v = value(p, batch, valid);
    return {v, v};
  }
};

struct SphereLanes : Everywhere {
  const SphereField& sphere;
  HWY_INLINE F value(const Points& p, const Batch&, M) const {
    const F squared = hn::MulAdd(p.x, p.x, hn::MulAdd(p.y, p.y, hn::Mul(p.z, p.z)));
    return hn::Sub(set(sphere.radius), hn::Sqrt(squared));
  }
  HWY_INLINE F bound(const Points& p, F) const { return value(p, Batch(), M()); }
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch& batch, M valid) const {
    const F v = value(p, batch, valid);
    return {v, v};
  }
};

struct RevolvedLanes : Everywhere {
  const RevolvedField& solid;
  HWY_INLINE F value(const Points& p, const Batch&, M) const {
    const F zero = hn::Zero(f32);
    const F radius = set(solid.radius);
    const F half = set(solid.half_height);
    const F r2 = hn::MulAdd(p.x, p.x, hn::Mul(p.y, p.y));
    if (solid.profile == RevolvedField::Profile::capsule) {
      const F beyond = hn::Max(hn::Sub(hn::Abs(p.z), half), zero);
      return hn::Sub(hn::Add(radius, set(solid.rounding)), hn::Sqrt(hn::MulAdd(beyond, beyond, r2)));
    }
    const F r = hn::Sqrt(r2);
    if (solid.profile == RevolvedField::Profile::cylinder) {
      const F qr = hn::Sub(r, radius);
      const F qz = hn::Sub(hn::Abs(p.z), half);
      const F outr = hn::Max(qr, zero);
      const F outz = hn::Max(qz, zero);
      const F outside = hn::Sqrt(hn::MulAdd(outr, outr, hn::Mul(outz, outz)));
      return hn::Sub(set(solid.rounding), hn::Add(outside, hn::Min(hn::Max(qr, qz), zero)));
    }
    const ConeSlant slant(solid);
    const F down = hn::Sub(half, p.z);  // from the tip
    const F over_slant = hn::Sub(hn::Mul(set(slant.normal_r), r), hn::Mul(set(slant.normal_z), down));
    const F below_base = hn::Sub(down, hn::Add(half, half));
    const F along = hn::MulAdd(set(slant.along_r), r, hn::Mul(set(slant.along_z), down));
    const F t = hn::Min(hn::Max(along, zero), set(1));
    const F sr = hn::Sub(r, hn::Mul(t, radius));
    const F sz = hn::Sub(down, hn::Mul(t, hn::Add(half, half)));
    const F br = hn::Max(hn::Sub(r, radius), zero);
    const F nearest = hn::Min(hn::MulAdd(sr, sr, hn::Mul(sz, sz)), hn::MulAdd(br, br, hn::Mul(below_base, below_base)));
    const F deepest = hn::Max(over_slant, below_base);
    const F inside = hn::Neg(deepest);
    const F v = hn::IfThenElse(hn::Le(deepest, zero), inside, hn::Neg(hn::Sqrt(nearest)));
    return hn::Add(set(solid.rounding), v);
  }
  HWY_INLINE F bound(const Points& p, F) const { return value(p, Batch(), M()); }
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch& batch, M valid) const {
    const F v = value(p, batch, valid);
    return {v, v};
  }
};

struct PolytopeLanes : Everywhere {
  const PolytopeField& solid;
  HWY_INLINE F value(const Points& p, const Batch&, M) const {
    F least = set(std::numeric_limits<float>::infinity());
    for (const HalfSpaceField& plane : solid.planes) {
      const F z = hn::NegMulAdd(set(plane.outward_normal.z), p.z, set(plane.offset));
      const F yz = hn::NegMulAdd(set(plane.outward_normal.y), p.y, z);
      least = hn::Min(least, hn::NegMulAdd(set(plane.outward_normal.x), p.x, yz));
    }
    return least;
  }
  HWY_INLINE F bound(const Points& p, F) const { return value(p, Batch(), M()); }
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch& batch, M valid) const {
    const F v = value(p, batch, valid);
    return {v, v};
  }
};

struct BelowLanes {
  static constexpr bool kHasFarGrid = false;
  struct Cells {};
  const SolidBelow& below;
  static HWY_INLINE Points place(const Affine& a, const Points& p) { return {p.x, p.y, row(a, 2, p)}; }
  HWY_INLINE F value(const Points& p, const Batch&, M) const {
    return hn::Min(hn::Neg(p.z), hn::Add(p.z, set(below.thickness)));
  }
  HWY_INLINE F bound(const Points& p, F) const { return value(p, Batch(), M()); }
  HWY_INLINE Penetrations penetrations(const Points& p, const Batch& batch, M valid) const {
    const F v = value(p, batch, valid);
    return {v, v};
  }
  // By how much V grows at most where z grows by `rise`: towards the face that is nearer.
  HWY_INLINE F growth(const Points& p, F rise) const {
    const M upper = hn::Ge(p.z, set(-below.thickness / 2));
    return hn::Max(hn::IfThenElse(upper, hn::Neg(rise), rise), hn::Zero(f32));
  }
};

struct PlainLanes : Everywhere {
  const PlainMap& plain;
  const PointshellView& shell;

  template <class Lookup>
  F each(const Points& p, M valid, Lookup lookup) const {
    HWY_ALIGN float x[kLanePadding];
    HWY_ALIGN float y[kLanePadding];
    HWY_ALIGN float z[kLanePadding];
    HWY_ALIGN float wanted[kLanePadding];
    hn::Store(p.x, f32, x);
    hn::Store(p.y, f32, y);
    hn::Store(p.z, f32, z);
    hn::Store(hn::IfThenElseZero(valid, set(1)), f32, wanted);
    HWY_ALIGN float out[kLanePadding] = {};
    for (std::size_t lane = 0; lane < hn::Lanes(f32); ++lane) {
      if (wanted[lane] != 0) out[lane] = lookup(Vec3{x[lane], y[lane], z[lane]}, lane);
    }
    return hn::Load(f32, out);
  }
  F value(const Points& p, const Batch& batch, M valid) const {
    HWY_ALIGN std::uint32_t numbers[kLanePadding];
    hn::Store(numbers_of(batch), Words(), numbers);
    return each(p, valid, [&](Vec3 point, std::size_t lane) {
      const Vec3 n = point_inward_normal(shell, numbers[lane]);
      const float* const r = plain.rotation;
      const Vec3 normal{r[0] * n.x + r[1] * n.y + r[2] * n.z, r[3] * n.x + r[4] * n.y + r[5] * n.z,
                        r[6] * n.x + r[7] * n.y + r[8] * n.z};
      return voxelmap_penetration(*plain.map, point, normal);
    });
  }
  F bound(const Points& p, F) const {
    return each(p, hn::FirstN(f32, hn::Lanes(f32)),
                [&](Vec3 point, std::size_t) { return voxelmap_bound(*plain.map, point); });
  }
  Penetrations penetrations(const Points& p, const Batch&, M valid) const {
    const F low = each(p, valid, [&](Vec3 at, std::size_t) { return penetration_interval(*plain.map, at).low; });
    const F high = each(p, valid, [&](Vec3 at, std::size_t) { return penetration_interval(*plain.map, at).high; });
    return {low, high};
  }
};

HWY_INLINE BoxLanes lanes_of(const BoxField& field, const PointshellView&) {
  return {{}, field};
}
HWY_INLINE SphereLanes lanes_of(const SphereField& field, const PointshellView&) {
  return {{}, field};
}
HWY_INLINE RevolvedLanes lanes_of(const RevolvedField& field, const PointshellView&) {
  return {{}, field};
}
HWY_INLINE PolytopeLanes lanes_of(const PolytopeField& field, const PointshellView&) {
  return {{}, field};
}
HWY_INLINE BelowLanes lanes_of(const SolidBelow& field, const PointshellView&) {
  return {field};
}
HWY_INLINE PlainLanes lanes_of(const PlainMap& field, const PointshellView& shell) {
  return {{}, field, shell};
}

// Loads a vector from `from`, where the row ends after `available` elements. Lanes beyond the end are 0.
template <class D>
HWY_INLINE hn::Vec<D> load(D d, const hn::TFromD<D>* from, std::size_t available) {
  if (HWY_LIKELY(available >= hn::Lanes(d))) return hn::LoadU(d, from);
  HWY_ALIGN hn::TFromD<D> copy[kLanePadding] = {};
  std::memcpy(copy, from, available * sizeof(*from));
  return hn::Load(d, copy);
}

HWY_INLINE F load_codes(const std::uint16_t* row, std::size_t length, const Batch& batch) {
  const hn::Rebind<std::uint16_t, Floats> u16;
  return hn::ConvertTo(f32, hn::PromoteTo(i32, load(u16, row + batch.first, length - batch.first)));
}
HWY_INLINE Points load_places(const std::uint16_t* const* rows, std::size_t length, const Batch& batch) {
  return {load_codes(rows[0], length, batch), load_codes(rows[1], length, batch), load_codes(rows[2], length, batch)};
}
HWY_INLINE Points load_points(const PointshellView& shell, const Batch& batch) {
  return load_places(shell.position, shell.points, batch);
}
HWY_INLINE Points load_centres(const PointshellView& shell, const Batch& batch) {
  return load_places(shell.sphere, shell.nodes, batch);
}
HWY_INLINE F load_radii(const PointshellView& shell, const Batch& batch) {
  return load_codes(shell.sphere[3], shell.nodes, batch);
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // toggled guard
