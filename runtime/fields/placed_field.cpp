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

template <class Field>
void look_up_places(const void* field, const Affine& to_field, const Places& places, float* out) {
  const PointshellView none;
  const auto lanes = lanes_of(*static_cast<const Field*>(field), none);
  const auto step = static_cast<std::uint32_t>(hn::Lanes(f32));
  for (std::uint32_t i = 0; i < places.count; i += step) {
    // Lanes beyond the last place repeat the first one, which likely is in the band as well.
    const M valid = hn::FirstN(f32, places.count - i);
    const auto load_row = [&](const float* row) { return hn::IfThenElse(valid, hn::Load(f32, row + i), set(row[0])); };
    const Points p = lanes.place(to_field, {load_row(places.x), load_row(places.y), load_row(places.z)});
    if constexpr (std::is_base_of_v<SampledMap, Field>) {
      hn::StoreU(lanes.value_of(p, lanes.look_up(p)), f32, out + i);
    } else {
      hn::StoreU(lanes.value(p, Batch(), valid), f32, out + i);
    }
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

PlacedField::PlacedField(FieldRef field, const Pose& to_field) noexcept : field_(field), to_field_(to_field) {
  const auto use = [&]<class Kernel>(const Kernel& kernel, const Frame& frame, float, const Pose& pose) {
    look_up_ = HWY_DYNAMIC_DISPATCH(look_up_here)(kernel_kind<Kernel>());
    constexpr float kOrigin[3] = {};
    affine_ = affine(pose, frame, kOrigin, 1);
    unit_ = static_cast<float>(frame.unit);
    if constexpr (std::is_base_of_v<SampledMap, Kernel>) {
      map_ = kernel;
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

float PlacedField::penetration(Vec3 place) const noexcept {
  const Vec3 p = to_field_.apply(place);
  const VoxelmapView* const map = field_.voxelmap();
  return map != nullptr ? voxelmap_penetration(*map, p, {}) : vps::penetration(field_, p);
}

Vec3 PlacedField::outward_normal(Vec3 place) const noexcept {
  return to_field_.rotate_back(vps::outward_normal(field_, to_field_.apply(place)));
}

}  // namespace vps::detail
#endif
