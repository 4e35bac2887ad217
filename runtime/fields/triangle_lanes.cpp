// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time. Rounds as triangle.h does.
#include "runtime/fields/triangle.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/fields/triangle_lanes.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include <algorithm>

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, Spheres::kMost>;
using F = hn::Vec<Floats>;
constexpr Floats f32;

struct Centres {
  F x, y, z;
};
HWY_INLINE Centres load_centres(const Spheres& spheres, std::size_t from) {
  return {hn::Load(f32, spheres.x + from), hn::Load(f32, spheres.y + from), hn::Load(f32, spheres.z + from)};
}

HWY_INLINE F along(Vec3 v, const Centres& p) {
  const F xy = hn::Add(hn::Mul(hn::Set(f32, v.x), p.x), hn::Mul(hn::Set(f32, v.y), p.y));
  return hn::Add(xy, hn::Mul(hn::Set(f32, v.z), p.z));
}

struct Off {
  F squared;  // Triangle::least_squared
  F beyond;   // Triangle::beyond
};
HWY_INLINE Off off(const Triangle& t, const Centres& p) {
  const F height = hn::Sub(along(t.normal, p), hn::Set(f32, t.offset));
  F beyond = hn::Zero(f32);
  for (int i = 0; i < 3; ++i) beyond = hn::Max(beyond, hn::Sub(hn::Set(f32, t.side_offset[i]), along(t.side[i], p)));
  return {hn::Add(hn::Mul(height, height), hn::Mul(beyond, beyond)), beyond};
}

HWY_INLINE std::uint16_t bits_of(hn::Mask<Floats> mask) {
  std::uint8_t bytes[8] = {};  // as many as StoreMaskBits may write
  hn::StoreMaskBits(f32, mask, bytes);
  return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8);
}

void find_within_here(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& spheres,
                      std::span<std::uint16_t> masks, float (&least)[Spheres::kMost]) {
  std::fill(masks.begin(), masks.end(), std::uint16_t{0});
  for (std::size_t from = 0; from < Spheres::kMost; from += hn::Lanes(f32)) {
    const Centres p = load_centres(spheres, from);
    const F reach = hn::Load(f32, spheres.reach + from);
    const F reach_squared = hn::Mul(reach, reach);
    F nearest = hn::Set(f32, std::numeric_limits<float>::max());
    for (std::size_t i = 0; i < list.size(); ++i) {
      const Triangle& t = triangles[list[i]];
      const F squared = off(t, p).squared;
      nearest = hn::Min(nearest, squared);
      const Centres away{hn::Sub(p.x, hn::Set(f32, t.centre.x)), hn::Sub(p.y, hn::Set(f32, t.centre.y)),
                         hn::Sub(p.z, hn::Set(f32, t.centre.z))};
      const F from_centre = hn::Add(hn::Add(hn::Mul(away.x, away.x), hn::Mul(away.y, away.y)), hn::Mul(away.z, away.z));
      const F farthest = hn::Add(reach, hn::Set(f32, t.radius));
      const auto within = hn::And(hn::Le(from_centre, hn::Mul(farthest, farthest)), hn::Le(squared, reach_squared));
      masks[i] = static_cast<std::uint16_t>(masks[i] | bits_of(within) << from);
    }
    hn::StoreU(nearest, f32, least + from);
  }
}

void find_nearest_faces_here(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& places,
                             float reach, NearestFaces& out) {
  const hn::Rebind<std::uint32_t, Floats> u32;
  for (std::size_t from = 0; from < Spheres::kMost; from += hn::Lanes(f32)) {
    const Centres p = load_centres(places, from);
    F squared = hn::Set(f32, reach * reach);
    F beyond = hn::Zero(f32);
    auto number = hn::Set(u32, NearestFaces::kNone);
    for (const std::uint32_t one : list) {
      const Off there = off(triangles[one], p);
      const auto nearer = hn::Lt(there.squared, squared);
      squared = hn::IfThenElse(nearer, there.squared, squared);
      beyond = hn::IfThenElse(nearer, there.beyond, beyond);
      number = hn::IfThenElse(hn::RebindMask(u32, nearer), hn::Set(u32, one), number);
    }
    hn::Store(squared, f32, out.squared + from);
    hn::Store(beyond, f32, out.beyond + from);
    hn::Store(number, u32, out.number + from);
  }
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(find_within_here);
HWY_EXPORT(find_nearest_faces_here);

void find_within(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& spheres,
                 std::span<std::uint16_t> masks, float (&least)[Spheres::kMost]) {
  HWY_DYNAMIC_DISPATCH(find_within_here)(triangles, list, spheres, masks, least);
}

void find_nearest_faces(const Triangle* triangles, std::span<const std::uint32_t> list, const Spheres& places,
                        float reach, NearestFaces& out) {
  HWY_DYNAMIC_DISPATCH(find_nearest_faces_here)(triangles, list, places, reach, out);
}

}  // namespace vps::detail
#endif
