// SPDX-License-Identifier: Zlib
// Compiled once per instruction set by Highway, chosen at run time.
#include "runtime/fields/placed_field.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/fields/placed_field.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h.
#include <hwy/highway.h>

#include "runtime/fields/sampled_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace vps::detail::HWY_NAMESPACE {

// Lanes beyond the last place repeat the first one, which likely is in the band as well.
HWY_INLINE Points load_places(const Places& places, std::uint32_t from) {
  const M valid = hn::FirstN(f32, places.count - from);
  const auto load_row = [&](const float* row) { return hn::IfThenElse(valid, hn::Load(f32, row + from), set(row[0])); };
  return {load_row(places.x), load_row(places.y), load_row(places.z)};
}

template <class Field>
void look_up_places(const void* field, const Affine& to_field, const Places& places, float* out) {
  const PointshellView none;
  const auto lanes = lanes_of(*static_cast<const Field*>(field), none);
  const auto step = static_cast<std::uint32_t>(hn::Lanes(f32));
  std::uint32_t i = 0;
  if constexpr (std::is_base_of_v<SampledMap, Field>) {
    using Cells = typename decltype(lanes)::Cells;
    const auto place = [&](std::uint32_t from) { return lanes.place(to_field, load_places(places, from)); };
    const auto store = [&](const Points& p, const Cells& cells, std::uint32_t from) {
      hn::StoreU(lanes.value_of(p, lanes.interpolate(cells)), f32, out + from);
    };
    for (; i + step < places.count; i += 2 * step) {
      const Points p = place(i);
      const Points q = place(i + step);
      Cells of_p;
      Cells of_q;
      find_cells_together(lanes, p, lanes, q, of_p, of_q);
      store(p, of_p, i);
      store(q, of_q, i + step);
    }
    if (i < places.count) {
      const Points p = place(i);
      store(p, lanes.find_cells(p), i);
    }
  } else {
    for (; i < places.count; i += step) {
      const Points p = lanes.place(to_field, load_places(places, i));
      hn::StoreU(lanes.value(p, Batch(), hn::FirstN(f32, places.count - i)), f32, out + i);
    }
  }
}

// The same places in two maps.
void look_up_both(const SampledMap& first, const Affine& to_first, const SampledMap& second, const Affine& to_second,
                  const Places& places, float* of_first, float* of_second) {
  const SampledLanes<std::int8_t> a{{}, first};
  const SampledLanes<std::int8_t> b{{}, second};
  for (std::uint32_t i = 0; i < places.count; i += static_cast<std::uint32_t>(hn::Lanes(f32))) {
    const Points at = load_places(places, i);
    const Points p = a.place(to_first, at);
    const Points q = b.place(to_second, at);
    SampledLanes<std::int8_t>::Cells of_p;
    SampledLanes<std::int8_t>::Cells of_q;
    find_cells_together(a, p, b, q, of_p, of_q);
    hn::StoreU(a.value_of(p, a.interpolate(of_p)), f32, of_first + i);
    hn::StoreU(b.value_of(q, b.interpolate(of_q)), f32, of_second + i);
  }
}

using LookUp = void (*)(const void*, const Affine&, const Places&, float*);
template <class Field>
constexpr LookUp look_up_of() {
  if constexpr (std::is_same_v<Field, PlainMap>) {
    return nullptr;  // it needs the normals of a shell's points
  } else {
    return &look_up_places<Field>;
  }
}
template <class... Fields>
LookUp look_up_at(std::size_t kind, const std::tuple<Fields...>*) {
  static constexpr LookUp kAll[] = {look_up_of<Fields>()...};
  return kAll[kind];
}
LookUp look_up_here(std::size_t kind) {
  return look_up_at(kind, static_cast<const KernelFields*>(nullptr));
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(look_up_here);
HWY_EXPORT(look_up_both);

void FieldAtPlaces::penetrations_beside(const PlacedField& other, const Places& places, Values& own,
                                        Values& others) const noexcept {
  penetrations(places, own);
  other.penetrations(places, others);
}

PlacedField::PlacedField(FieldRef field, const Pose& to_field) noexcept : field_(field), to_field_(to_field) {
  const auto use = [&]<class Kernel>(const Kernel& kernel, const Frame& frame, float, const Pose& pose) {
    look_up_ = HWY_DYNAMIC_DISPATCH(look_up_here)(kernel_kind<Kernel>());
    constexpr float kOrigin[3] = {};
    affine_ = affine(pose, frame, kOrigin, 1);
    unit_ = static_cast<float>(frame.unit);
    if constexpr (std::is_base_of_v<SampledMap, Kernel>) {
      map_ = kernel;
      has_small_map_ = std::is_same_v<Kernel, SampledMap8>;
    } else if constexpr (std::is_same_v<Kernel, SolidBelow>) {
      static constexpr SolidBelow kBelow;
      analytic_ = &kBelow;
    } else {
      analytic_ = &kernel;  // the caller's field
    }
    return Status::ok;
  };
  (void)field.visit([&](const auto& kind) { return in_kernel_form(kind, to_field, use); });
}

void PlacedField::penetrations(const Places& places, Values& out) const noexcept {
  if (look_up_ == nullptr) {
    for (std::uint32_t i = 0; i < places.count; ++i) out[i] = penetration(places[i]);
    return;
  }
  look_up_(analytic_ != nullptr ? analytic_ : &map_, affine_, places, out.data());
  for (std::uint32_t i = 0; i < places.count; ++i) out[i] *= unit_;
}

void PlacedField::penetrations_beside(const PlacedField& other, const Places& places, Values& own,
                                      Values& others) const noexcept {
  if (!has_small_map_ || !other.has_small_map_) {
    return FieldAtPlaces::penetrations_beside(other, places, own, others);
  }
  HWY_DYNAMIC_DISPATCH(look_up_both)(map_, affine_, other.map_, other.affine_, places, own.data(), others.data());
  for (std::uint32_t i = 0; i < places.count; ++i) {
    own[i] *= unit_;
    others[i] *= other.unit_;
  }
}

float PlacedField::penetration(Vec3 place) const noexcept {
  const Vec3 p = to_field_.apply(place);
  const VoxelmapView* const map = field_.voxelmap();
  return map != nullptr ? voxelmap_penetration(*map, p, {}) : vps::penetration(field_, p);
}

}  // namespace vps::detail
#endif
