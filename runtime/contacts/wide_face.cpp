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

// A shell in the samples of a map. [vx]
struct Place {
  float centre[3];
  float radius = 0;
};

Place place_in(const VoxelmapView& map, const StepPair& pair) {
  const Frame frame = voxel_frame(map);
  const auto unit = static_cast<float>(frame.unit);
  const Vec3 at = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  return {{(at.x - static_cast<float>(frame.origin[0])) / unit, (at.y - static_cast<float>(frame.origin[1])) / unit,
           (at.z - static_cast<float>(frame.origin[2])) / unit},
          sphere_radius(pair.shell, 0) / unit};
}

std::optional<Vec3> face_of(const VoxelmapView& map, const StepPair& pair, float distance, FaceIs how,
                            ContactCache& cache) {
  if (map.field != Field::scaled || map.planes == nullptr) return {};
  const Place place = place_in(map, pair);
  const RegionBound before = cache.region;
  const std::uint64_t before_field = cache.region_field;
  keep_region(map, field_id(map), place.centre, place.radius, distance / map.voxel_size, cache);
  const RegionBound& region = cache.region;
  const float most = how == FaceIs::flat ? kFlat_vx : std::numeric_limits<float>::max();
  const Vec3 inward{region.slope[0], region.slope[1], region.slope[2]};
  if (region.is_tight && region.slack <= most) return (-1 / length(inward)) * inward;
  // A query for contacts needs a smaller box only.
  if (before.is_tight && !region.is_tight) {
    cache.region = before;
    cache.region_field = before_field;
  }
  return {};
}

// The bound of a tight region at a place. [vx]
float height_in(const RegionBound& region, const float (&at)[3]) {
  float height = region.height;
  for (int axis = 0; axis < 3; ++axis) {
    height += region.slope[axis] * (at[axis] - 0.5F * (region.low[axis] + region.high[axis]));
  }
  return height;
}

}  // namespace

std::optional<Vec3> wide_face(const StepPair& pair, const Partner& partner, float distance, FaceIs how,
                              ContactCache& cache) {
  if (partner.sheet != nullptr || pair.shell.points == 0) return {};
  return partner.field.visit([&](const auto& field) -> std::optional<Vec3> {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, HalfSpaceField>) return field.outward_normal;
    if constexpr (std::is_same_v<Kind, BoxField>) {
      if (const auto faces = faces_near(field, pair.shell, pair.shell_to_field)) return faces->upper.outward_normal;
    }
    if constexpr (std::is_same_v<Kind, VoxelmapView>) return face_of(field, pair, distance, how, cache);
    return {};
  });
}

std::optional<HalfSpaceField> flat_ground(const StepPair& pair, const Partner& partner, float distance,
                                          ContactCache& cache) {
  constexpr std::uint32_t kMostTests = 1 << 13;  // some microseconds
  constexpr float kSteep = 0.02F;                // V is rounded: its slope is not quite 1
  constexpr float kAlong = 1 - 5e-7F;            // cosine of a thousandth of a radian
  const VoxelmapView* const map = partner.map();
  if (map == nullptr) return {};
  const std::optional<Vec3> face = wide_face(pair, partner, distance, FaceIs::flat, cache);
  if (!face) return {};
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  const Vec3 below = centre + (map->voxel_size * height_in(cache.region, place_in(*map, pair).centre)) * *face;
  const LinearPart part = linear_part(*map, below, penetration(*map, below, *face));
  const float steep = length(part.slope);
  const Vec3 out = (-1 / steep) * part.slope;
  if (!(std::abs(steep - 1) < kSteep && dot(out, *face) > kAlong)) return {};
  // The square below all places where the shell may touch.
  const Vec3 foot = below + (part.v / steep) * out;
  const Vec3 aside = cross(std::abs(out.z) < 0.6F ? Vec3{0, 0, 1} : Vec3{1, 0, 0}, out);
  const Vec3 u = ((kStretch * sphere_radius(pair.shell, 0) + distance) / length(aside)) * aside;
  const Vec3 v = cross(out, u);
  const std::array<Vec3, 4> corners{foot + u + v, foot + u - v, foot - u - v, foot - u + v};
  if (!is_linear_between(*map, part, corners, kFlat_vx * map->voxel_size, kMostTests)) return {};
  return HalfSpaceField{out, dot(out, foot)};
}

}  // namespace vps::detail
