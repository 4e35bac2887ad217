// SPDX-License-Identifier: Zlib
// The public point queries. Paper: Sec. 2.2.
#include "runtime/penetration.h"

namespace vps {

float penetration(const VoxelmapView& map, Vec3 point, Vec3 inward_normal) noexcept {
  return detail::voxelmap_penetration(map, point, inward_normal);
}
float penetration_bound(const VoxelmapView& map, Vec3 point) noexcept { return detail::voxelmap_bound(map, point); }
float penetration(const BoxField& field, Vec3 point) noexcept { return detail::box_penetration(field, point); }
float penetration(const SphereField& field, Vec3 point) noexcept { return detail::sphere_penetration(field, point); }
float penetration(const HalfSpaceField& field, Vec3 point) noexcept {
  return detail::half_space_penetration(field, point);
}

}  // namespace vps
