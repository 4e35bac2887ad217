// SPDX-License-Identifier: Zlib
// Finds out whether a partner is flat around a shell.
#include "runtime/contacts/wide_face.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "runtime/contacts/fit_plane.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/linear_part.h"
#include "runtime/fields/region_bound.h"

namespace vps::detail {
namespace {

constexpr std::uint32_t kMostTests = 1 << 14;  // a thousand bricks: tens of microseconds
// Balls have centres on a grid: the plane does not depend on where the shell came from. Near the end of a face only the
// narrow ones are flat. [vx]
constexpr float kWideGrid_vx = 8;
constexpr float kNarrowGrid_vx = 1;

std::optional<Vec3> face_of(const VoxelmapView& map, const StepPair& pair, float distance, ContactCache& cache) {
  if (map.field != Field::scaled || map.planes == nullptr) return {};
  const Vec3 at = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  const Frame frame = voxel_frame(map);
  const auto in_grid = [&](float p, std::size_t axis) {
    return (p - static_cast<float>(frame.origin[axis])) / static_cast<float>(frame.unit);
  };
  const float centre[3] = {in_grid(at.x, 0), in_grid(at.y, 1), in_grid(at.z, 2)};
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

// Whether a plane is that of the side of a thin body where the shell is. The centre of the grid's ball may be on the
// other side.
bool is_of_this_side(const VoxelmapView& map, const HalfSpaceField& plane, Vec3 centre) {
  constexpr float kOfBand = 0.75F;  // farther out V is rough
  constexpr float kSame_vx = 0.5F;
  const auto in_band = [&](float v) { return std::clamp(v, -kOfBand * map.band_outer, kOfBand * map.band_inner); };
  const float difference = in_band(voxelmap_penetration(map, centre, {})) - in_band(value_at(plane, centre));
  return std::abs(difference) <= kSame_vx * map.voxel_size;
}

// What is known of the ball around a shell whose centre is the nearest place of a grid.
// @param prove  function that finds out, for a new ball
template <class Prove>
const KnownGround& known_around(const VoxelmapView& map, Vec3 at, float reach, float grid_vx,
                                std::array<KnownGround, 2>& known, const Prove& prove) {
  const float unit = map.voxel_size;
  const float grid = grid_vx * unit;
  const Vec3 centre{grid * std::round(at.x / grid), grid * std::round(at.y / grid), grid * std::round(at.z / grid)};
  constexpr float kCorner = 0.8661F;  // of a cube, from its middle
  const float radius = unit * std::ceil(reach / unit + kCorner * grid_vx);
  const auto is_this = [&](const KnownGround& one) {
    return one.radius == radius && one.centre.x == centre.x && one.centre.y == centre.y && one.centre.z == centre.z;
  };
  if (is_this(known[0])) return known[0];
  std::swap(known[0], known[1]);
  KnownGround& ground = known[0];
  if (is_this(ground)) return ground;
  ground = {centre, radius, {}, false};
  prove(ground);
  return ground;
}

const KnownGround& ground_around(const VoxelmapView& map, Vec3 at, float reach, float grid_vx,
                                 std::array<KnownGround, 2>& known) {
  return known_around(map, at, reach, grid_vx, known, [&](KnownGround& ground) {
    const std::optional<HalfSpaceField> plane = fit_plane(map, ground.centre, ground.radius);
    if (!plane) return;
    ground.plane = *plane;
    ground.is_flat = is_plane_within(map, *plane, ground.centre, ground.radius, kFlat_vx * map.voxel_size, kMostTests);
  });
}

}  // namespace

float longest_side(const VoxelmapView& map) noexcept {
  float longest = 0;
  for (int axis = 0; axis < 3; ++axis) longest = std::max(longest, map.bounds_max[axis] - map.bounds_min[axis]);
  return longest;
}

std::optional<Vec3> wide_face(const StepPair& pair, const Partner& partner) {
  // A body that slides meets another part of the tops.
  if (partner.sheet != nullptr || partner.tops != nullptr || pair.shell.points == 0) return {};
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

const HalfSpaceField* flat_around(const VoxelmapView& map, Vec3 centre, float reach, bool has_ends,
                                  GroundMemory& memory) {
  if (map.field != Field::scaled) return nullptr;
  const auto plane_of = [&](float grid_vx, std::array<KnownGround, 2>& known) -> const HalfSpaceField* {
    const KnownGround& ground = ground_around(map, centre, reach, grid_vx, known);
    return ground.is_flat && is_of_this_side(map, ground.plane, centre) ? &ground.plane : nullptr;
  };
  const HalfSpaceField* const wide = plane_of(kWideGrid_vx, memory.wide);
  return wide != nullptr || !has_ends ? wide : plane_of(kNarrowGrid_vx, memory.narrow);
}

const HalfSpaceField* tops_around(const VoxelmapView& map, Vec3 centre, float reach, GroundMemory& memory) {
  if (map.field != Field::scaled) return nullptr;
  const KnownGround& ground = known_around(map, centre, reach, kWideGrid_vx, memory.tops, [&](KnownGround& tops) {
    // Ground is larger than what lies on it.
    constexpr float kGround = 3;
    if (!(kGround * tops.radius <= longest_side(map))) return;
    const std::optional<HalfSpaceField> plane = fit_top(map, tops.centre, tops.radius);
    if (!plane) return;
    tops.plane = *plane;
    tops.is_flat = is_all_below(map, *plane, tops.centre, tops.radius, kTop_vx * map.voxel_size, kMostTests);
  });
  return ground.is_flat ? &ground.plane : nullptr;
}

bool has_ground(const VoxelmapView& map, const HalfSpaceField& tops, Vec3 place) noexcept {
  constexpr float kThere_vx = 0.1F;
  const Vec3 foot = place + value_at(tops, place) * tops.outward_normal;
  return voxelmap_penetration(map, foot, {}) > -kThere_vx * map.voxel_size;
}

bool Partner::has_ground(Vec3 place) const noexcept {
  return field.visit([&](const auto& plane) {
    using Kind = std::remove_cvref_t<decltype(plane)>;
    if constexpr (std::is_same_v<Kind, HalfSpaceField>) return detail::has_ground(*tops, plane, place);
    return true;
  });
}

// Beside a wall the distance is the same at any height, so lower ground is nearer than what counts as touching.
Footing::Footing(const StepPair& pair, const VoxelmapView& map, const HalfSpaceField& tops) noexcept
    : map_(map), tops_(tops), lower_within_(pair.margin + 0.5F * pair.touching()) {}

bool Footing::test(Vec3 place, Vec3 lowest) noexcept {
  ++tested_;
  if (has_ground(map_, tops_, place)) {
    ++grounded_;
    return true;
  }
  touches_lower_ = touches_lower_ || voxelmap_penetration(map_, lowest, {}) >= -lower_within_;
  return false;
}

bool moves_along(const StepMotion& body, const StepMotion& ground, Vec3 normal, double voxel_size) noexcept {
  constexpr float kTips_vx = 0.25F;  // one that slides tips less than this in a step, one that rolls turns more
  if (dot(ground.turn, ground.turn) > 0) return false;
  const float way = std::abs(dot(normal, body.way - ground.way)) + length(cross(normal, body.turn)) * body.radius;
  return way <= length(body.fall - ground.fall) + kTips_vx * static_cast<float>(voxel_size);
}

const HalfSpaceField* flat_ground(const StepPair& pair, const Partner& partner, float distance, GroundMemory& memory) {
  const VoxelmapView* const map = partner.map();
  if (map == nullptr || pair.shell.points == 0) return nullptr;
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  return flat_around(*map, centre, kStretch * sphere_radius(pair.shell, 0) + distance, true, memory);
}

}  // namespace vps::detail
