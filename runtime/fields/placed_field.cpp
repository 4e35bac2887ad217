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

template <class Integer>
void look_up_places(const SampledMap& map, const Affine& to_map, const Places& places, float* out) {
  const SampledLanes<Integer> lanes{{}, map};
  const auto step = static_cast<std::uint32_t>(hn::Lanes(f32));
  for (std::uint32_t i = 0; i < places.count; i += step) {
    const Points p =
        lanes.place(to_map, {hn::Load(f32, places.x + i), hn::Load(f32, places.y + i), hn::Load(f32, places.z + i)});
    hn::StoreU(lanes.value_of(p, lanes.look_up(p)), f32, out + i);
  }
}

using LookUp = void (*)(const SampledMap&, const Affine&, const Places&, float*);
LookUp look_up_here(bool is_wide) {
  return is_wide ? &look_up_places<std::int16_t> : &look_up_places<std::int8_t>;
}

}  // namespace vps::detail::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace vps::detail {

HWY_EXPORT(look_up_here);

PlacedField::PlacedField(FieldRef field, const Pose& to_field) noexcept : field_(field), to_field_(to_field) {
  const VoxelmapView* const map = field.voxelmap();
  // Offsets into samples are 32 bits wide in the kernel.
  if (map == nullptr || map->field != Field::scaled || map->field_bricks >= (1U << 23)) return;
  const Frame frame = voxel_frame(*map);
  constexpr float kOrigin[3] = {};
  map_ = sampled_map<SampledMap>(*map, frame);
  affine_ = affine(to_field, frame, kOrigin, 1);
  unit_ = map->voxel_size;
  look_up_ = HWY_DYNAMIC_DISPATCH(look_up_here)(map->element != ElementType::i8);
}

void PlacedField::penetrations(const Places& places, Values& out) const noexcept {
  if (look_up_ == nullptr) {
    for (std::uint32_t i = 0; i < places.count; ++i) out[i] = penetration(places[i]);
    return;
  }
  look_up_(map_, affine_, places, out.data());
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
