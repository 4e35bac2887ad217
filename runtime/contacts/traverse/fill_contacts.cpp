// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/contacts/traverse/fill_contacts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/contacts/traverse/fill_contacts.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "runtime/fields/field_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// Codes of some points, which lie anywhere in the shell's rows.
struct Codes {
  HWY_ALIGN std::int32_t position[3][kLanePadding] = {};
  HWY_ALIGN std::int32_t normal[kLanePadding] = {};
  HWY_ALIGN std::int32_t area[kLanePadding] = {};

  HWY_INLINE void load(const PointshellView& shell, const std::uint32_t* points, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t point = points[i];
      for (int axis = 0; axis < 3; ++axis) position[axis][i] = shell.position[axis][point];
      const std::uint8_t* const code = shell.inward_normal + 3 * std::size_t{point};
      normal[i] = code[0] | code[1] << 8 | code[2] << 16;
      area[i] = shell.area[point];
    }
  }
};

// Transform::rotate. Products and sums are rounded one by one, as there.
HWY_INLINE Points rotated(const Transform& transform, const Points& p) {
  const auto along = [&](int axis) {
    const float* const r = transform.r + 3 * axis;
    return hn::Add(hn::Add(hn::Mul(set(r[0]), p.x), hn::Mul(set(r[1]), p.y)), hn::Mul(set(r[2]), p.z));
  };
  return {along(0), along(1), along(2)};
}

// point_position
HWY_INLINE Points positions_of(const PointshellView& shell, const Codes& codes) {
  const auto along = [&](int axis) {
    const F code = hn::ConvertTo(f32, hn::Load(i32, codes.position[axis]));
    return hn::Add(set(shell.position_origin[axis]), hn::Mul(set(shell.position_step), code));
  };
  return {along(0), along(1), along(2)};
}

// point_inward_normal
HWY_INLINE Points normals_of(const Codes& codes) {
  static_assert(kUnitCode < 2048, "two coordinates of 12 bits");
  const I code = hn::Load(i32, codes.normal);
  const I unit = hn::Set(i32, kUnitCode);
  const F zero = hn::Zero(f32);
  F x = hn::ConvertTo(f32, hn::Sub(hn::And(code, hn::Set(i32, 4095)), unit));
  F y = hn::ConvertTo(f32, hn::Sub(hn::ShiftRight<12>(code), unit));
  const F z = hn::Sub(hn::Sub(set(kUnitCode), hn::Abs(x)), hn::Abs(y));
  const F fold = hn::Max(hn::Neg(z), zero);
  x = hn::Add(x, hn::IfThenElse(hn::Ge(x, zero), hn::Neg(fold), fold));
  y = hn::Add(y, hn::IfThenElse(hn::Ge(y, zero), hn::Neg(fold), fold));
  const F squared = hn::Add(hn::Add(hn::Mul(x, x), hn::Mul(y, y)), hn::Mul(z, z));
  const F scale = hn::Div(set(1), hn::Sqrt(squared));
  return {hn::Mul(x, scale), hn::Mul(y, scale), hn::Mul(z, scale)};
}

// Rows of contacts.
struct Rows {
  HWY_ALIGN float position[3][kLanePadding];
  HWY_ALIGN float normal[3][kLanePadding];
  HWY_ALIGN float penetration[kLanePadding];
  HWY_ALIGN float area[kLanePadding];

  static HWY_INLINE void store(const Points& p, float (&rows)[3][kLanePadding]) {
    hn::Store(p.x, f32, rows[0]);
    hn::Store(p.y, f32, rows[1]);
    hn::Store(p.z, f32, rows[2]);
  }
};

void fill_contacts_here(const PointshellView& shell, const Transform& transform, const HitRows& hits,
                        std::uint32_t count, Contact* out) {
  constexpr auto kLanes = static_cast<std::uint32_t>(hn::MaxLanes(Floats()));
  Codes codes;
  Rows rows;
  for (std::uint32_t first = 0; first < count; first += kLanes) {
    const std::uint32_t some = count - first < kLanes ? count - first : kLanes;
    codes.load(shell, hits.points + first, some);
    const Points turned = rotated(transform, positions_of(shell, codes));
    const Vec3 t = transform.t;
    Rows::store({hn::Add(turned.x, set(t.x)), hn::Add(turned.y, set(t.y)), hn::Add(turned.z, set(t.z))}, rows.position);
    Rows::store(rotated(transform, normals_of(codes)), rows.normal);
    hn::Store(hn::Mul(set(hits.unit), hn::LoadU(f32, hits.penetrations + first)), f32, rows.penetration);
    const I area = hn::Load(i32, codes.area);
    hn::Store(hn::Mul(set(shell.area_step), hn::ConvertTo(f32, hn::Mul(area, area))), f32, rows.area);
    for (std::uint32_t i = 0; i < some; ++i) {
      Contact& contact = out[first + i];
      contact.position = {rows.position[0][i], rows.position[1][i], rows.position[2][i]};
      contact.inward_normal = {rows.normal[0][i], rows.normal[1][i], rows.normal[2][i]};
      contact.penetration = rows.penetration[i];
      contact.area = rows.area[i];
      contact.point = hits.points[first + i];
      contact.node = hits.leaves[first + i];
    }
  }
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(fill_contacts_here);
void fill_contacts(const PointshellView& shell, const Transform& transform, const HitRows& hits, std::uint32_t count,
                   Contact* out) noexcept {
  HWY_DYNAMIC_DISPATCH(fill_contacts_here)(shell, transform, hits, count, out);
}

}  // namespace vps::detail
#endif
