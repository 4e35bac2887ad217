// SPDX-License-Identifier: Zlib
// Finds out whether a partner is flat around a shell.
#include "runtime/contacts/wide_face.h"

#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/linear_part.h"
#include "runtime/fields/region_bound.h"

namespace vps::detail {
namespace {

constexpr float kFlat_vx = 0.05F;
constexpr float kMoves_vx = 8;  // of the shell, until the plane is sought anew

// A place in the samples of a map. [vx]
std::array<float, 3> place_in(const VoxelmapView& map, Vec3 at) {
  const Frame frame = voxel_frame(map);
  const auto unit = static_cast<float>(frame.unit);
  return {(at.x - static_cast<float>(frame.origin[0])) / unit, (at.y - static_cast<float>(frame.origin[1])) / unit,
          (at.z - static_cast<float>(frame.origin[2])) / unit};
}

std::optional<Vec3> face_of(const VoxelmapView& map, const StepPair& pair, float distance, ContactCache& cache) {
  if (map.field != Field::scaled || map.planes == nullptr) return {};
  const std::array<float, 3> at = place_in(map, Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0)));
  const float centre[3] = {at[0], at[1], at[2]};
  const RegionBound before = cache.region;
  const std::uint64_t before_field = cache.region_field;
  keep_region(map, field_id(map), centre, sphere_radius(pair.shell, 0) / map.voxel_size, distance / map.voxel_size,
              cache);
  const float* const s = cache.region.slope;
  const Vec3 inward{s[0], s[1], s[2]};
  if (cache.region.is_tight) return (-1 / length(inward)) * inward;
  // A query for contacts needs a smaller box only.
  if (before.is_tight) {
    cache.region = before;
    cache.region_field = before_field;
  }
  return {};
}

// The bound of a region at a place. [vx]
float height_in(const RegionBound& region, const std::array<float, 3>& at) {
  float height = region.height;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    height += region.slope[axis] * (at[axis] - 0.5F * (region.low[axis] + region.high[axis]));
  }
  return height;
}

// Four places on a plane around a foot.
std::array<Vec3, 4> square(Vec3 foot, Vec3 normal, float half) {
  const Vec3 aside = cross(std::abs(normal.z) < 0.6F ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, normal);
  const Vec3 u = (half / length(aside)) * aside;
  const Vec3 v = cross(normal, u);
  return {foot + u + v, foot - u + v, foot - u - v, foot + u - v};
}

// The plane of the surface in a square, if it is flat there and no other surface lies above it:
// docs/internals/bounds.md, "A plane in place of the map".
// @param region  its box lies above the wider of the squares
// @param wider   half edge of the square if the bound of the region leaves room for other surfaces
std::optional<HalfSpaceField> plane_of(const VoxelmapView& map, const RegionBound& region, Vec3 foot, Vec3 normal,
                                       float half, float wider) {
  constexpr std::uint32_t kMostTests = 1 << 14;  // a thousand bricks: tens of microseconds, every eight voxels
  constexpr float kHigher_vx = 1.25F;
  const float unit = map.voxel_size;
  for (int i = 0; i < 3; ++i) {
    std::array<Vec3, 4> corners = square(foot, normal, half);
    for (Vec3& c : corners) c = c + penetration(map, c, normal) * normal;
    const Vec3 across = cross(corners[0] - corners[2], corners[1] - corners[3]);
    normal = (1 / length(across)) * across;
    foot = 0.25F * (corners[0] + corners[1] + corners[2] + corners[3]);
  }
  // The highest place where there may be a surface. [vx]
  const auto highest = [&](float edge) {
    float above = 0;
    for (const Vec3 c : square(foot, normal, edge)) above = std::max(above, height_in(region, place_in(map, c)));
    return above;
  };
  const LinearPart part{foot, -1.0F * normal, 0};
  const auto is_flat_at = [&](float height, float edge) {
    return is_linear_between(map, part, square(foot + height * normal, normal, edge), kFlat_vx * unit, kMostTests);
  };
  const bool is_alone = highest(half) <= kFlat_vx;
  if (!is_alone && !(highest(wider) < 1.9F * kHigher_vx)) return {};
  if (is_alone ? !is_flat_at(0, half) : !(is_flat_at(0, wider) && is_flat_at(kHigher_vx * unit, wider))) return {};
  return HalfSpaceField{normal, dot(normal, foot)};
}

}  // namespace

std::optional<Vec3> wide_face(const StepPair& pair, const Partner& partner) {
  if (partner.sheet != nullptr || pair.shell.points == 0) return {};
  return partner.field.visit([&](const auto& field) -> std::optional<Vec3> {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, HalfSpaceField>) return field.outward_normal;
    if constexpr (std::is_same_v<Kind, BoxField>) {
      if (const auto faces = faces_near(field, pair.shell, pair.shell_to_field)) return faces->upper.outward_normal;
    }
    return {};
  });
}

std::optional<Vec3> even_face(const StepPair& pair, const Partner& partner, float distance, ContactCache& cache) {
  const VoxelmapView* const map = partner.map();
  return map != nullptr ? face_of(*map, pair, distance, cache) : std::nullopt;
}

const HalfSpaceField* flat_ground(const StepPair& pair, const Partner& partner, float distance, GroundMemory& memory) {
  const VoxelmapView* const map = partner.map();
  if (map == nullptr || map->field != Field::scaled || map->planes == nullptr || pair.shell.points == 0) return nullptr;
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  const float reach = kStretch * sphere_radius(pair.shell, 0) + distance;
  const auto is_in = [&](float at, float low, float high) { return at - reach >= low && at + reach <= high; };
  const bool stays = is_in(centre.x, memory.low.x, memory.high.x) && is_in(centre.y, memory.low.y, memory.high.y) &&
                     is_in(centre.z, memory.low.z, memory.high.z);
  if (stays) return memory.is_flat ? &memory.plane : nullptr;
  const float unit = map->voxel_size;
  const float half = reach + kMoves_vx * unit;
  memory = {{}, centre - Vec3{half, half, half}, centre + Vec3{half, half, half}, false};
  const std::array<float, 3> at = place_in(*map, centre);
  const float h = half / unit;
  const RegionBound region = bound_region(*map, {at[0] - h, at[1] - h, at[2] - h}, {at[0] + h, at[1] + h, at[2] + h});
  if (!region.is_bound) return nullptr;
  const Vec3 inward{region.slope[0], region.slope[1], region.slope[2]};
  const Vec3 normal = (-1 / length(inward)) * inward;
  const Vec3 foot = centre + (unit * height_in(region, at)) * normal;
  const std::optional<HalfSpaceField> plane =
      plane_of(*map, region, foot, normal, reach + 1.75F * kMoves_vx * unit, 1.65F * half);
  if (!plane) return nullptr;
  memory.plane = *plane;
  memory.is_flat = true;
  return &memory.plane;
}

}  // namespace vps::detail
