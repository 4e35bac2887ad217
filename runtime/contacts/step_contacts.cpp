// SPDX-License-Identifier: Zlib
// The contacts of a pair for a step, for engines that describe their bodies as StepBody: chooses the roles of the
// bodies and gathers the contacts of both. Paper: Secs. 2.3 and 3.2.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <type_traits>

#include "runtime/contacts/pair_roles.h"
#include "runtime/contacts/side_contacts.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/grow.h"

namespace vps {
struct StepMemory::Content {
  struct Side {
    detail::PairMemory memory;
    std::uint64_t bodies = 0;  // whose memory it is
  };
  Side sides[2];  // the first body's points, the second's
};
StepMemory::StepMemory() noexcept = default;
StepMemory::StepMemory(StepMemory&& other) noexcept = default;
StepMemory& StepMemory::operator=(StepMemory&& other) noexcept = default;
StepMemory::~StepMemory() = default;

struct StepScratch::Content {
  detail::Workspace space;
  std::vector<StepContact> found;
};
StepScratch::StepScratch() noexcept = default;
StepScratch::StepScratch(StepScratch&& other) noexcept = default;
StepScratch& StepScratch::operator=(StepScratch&& other) noexcept = default;
StepScratch::~StepScratch() = default;

namespace {

using namespace detail;

constexpr std::uint32_t kOfSecond = 0x80000000U;  // in features: the point is the second body's

// The distances of a baked body, or null.
const VoxelmapView* map_of(const StepBody& body) noexcept {
  const VoxelmapView* const map = body.field.voxelmap();
  return map != nullptr && map->field != Field::none ? map : nullptr;
}
bool has_field(const StepBody& body) noexcept {
  return body.field.voxelmap() == nullptr || map_of(body) != nullptr;
}
float voxel_of(const StepBody& body) noexcept {
  const VoxelmapView* const map = map_of(body);
  if (map != nullptr) return map->voxel_size;
  // A shell alone: points are about a voxel and a half apart.
  return body.shell != nullptr && body.shell->points > 0 ? body.shell->covering_radius
                                                         : std::numeric_limits<float>::infinity();
}

RoleSide side_of(const StepBody& body) noexcept {
  return {body.shell, has_field(body), double{voxel_of(body)}};
}

// Differs where one of the bodies is another one or has another size.
std::uint64_t id_of(const StepBody& shell, const StepBody& field) noexcept {
  const std::uint64_t parts[] = {reinterpret_cast<std::uintptr_t>(shell.shell->position[0]), shell.shell->points,
                                 std::bit_cast<std::uint32_t>(shell.shell->position_step),
                                 field.field.visit([](const auto& of) { return field_id(of); })};
  return hash_bytes(std::as_bytes(std::span(parts)));
}

// Infinite for fields without bounds and for polytopes.
FieldBox box_of(const StepBody& body) noexcept {
  const auto around = [&](Vec3 half) { return FieldBox{-1.0F * half, half}; };
  return body.field.visit([&](const auto& field) {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, VoxelmapView>) {
      const float* const low = field.bounds_min;
      const float* const high = field.bounds_max;
      return FieldBox{{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
    } else if constexpr (std::is_same_v<Kind, BoxField>) {
      return around(field.half_extents);
    } else if constexpr (std::is_same_v<Kind, SphereField>) {
      return around({field.radius, field.radius, field.radius});
    } else if constexpr (std::is_same_v<Kind, RevolvedField>) {
      const float out = field.radius + field.rounding;
      const bool is_capsule = field.profile == RevolvedField::Profile::capsule;
      return around({out, out, field.half_height + (is_capsule ? out : field.rounding)});
    } else {
      constexpr float kFar = std::numeric_limits<float>::infinity();
      return around({kFar, kFar, kFar});
    }
  });
}

bool is_finite(const StepMotion& motion) noexcept {
  double sum = double{motion.radius};
  for (const double x : motion.centre) sum += x;
  for (const Vec3 v : {motion.way, motion.turn, motion.fall}) sum += double{v.x} + double{v.y} + double{v.z};
  return std::isfinite(sum);
}

// What the sides of a pair have in common.
struct BothSides {
  const StepOptions& options;
  bool both;  // each body's points are sought in the other
  std::size_t most;
  StepScratch::Content& scratch;
};

// Adds the contacts of one body's points to those of the pair, in the world.
// @param sign  of the normal: 1 where the shell's body is the first
// @param are_all  set: the other body's points are not needed
Status add_side(const BothSides& step, const StepBody& shell, const StepBody& field, float sign, PairMemory& memory,
                bool& are_all) {
  static const VoxelmapView none;
  static const StepMotion stands;
  const VoxelmapView* const map = map_of(shell);
  const bool moves = shell.motion != nullptr || field.motion != nullptr;
  const auto motion_of = [&](const StepBody& body) { return moves && body.motion == nullptr ? &stands : body.motion; };
  const StepPair pair{*shell.shell,
                      map != nullptr && map->field != Field::layers ? *map : none,
                      shell.pose,
                      field.pose,
                      double{voxel_of(shell)},
                      double{std::min(voxel_of(shell), voxel_of(field))},
                      0,
                      step.options.use,
                      0,
                      motion_of(shell),
                      motion_of(field)};
  Partner partner{field.field};
  std::array<Vec3, 8> corners;
  set_corners(corners, partner);
  // Between coarse points that are a little apart the surfaces may touch.
  const float touching = pair.touching();
  const float near = contact_distance(pair.voxel_size, spacing_vx(pair.shell, pair.shell_voxel));
  const bool are_coarse = step.options.use == StepUse::constraints && near > std::max(step.options.distance, touching);
  SideQuery query{are_coarse ? near : step.options.distance, step.both};
  query.approach = approach(pair);
  query.most = query.most_ahead = step.most;
  const double reach = double{query.distance + query.approach.way};
  const FieldBox box = box_of(field);
  // A field may lie a little outside the bounds of its mesh.
  const bool is_apart = !memory.touched && distance_to_box(pair, box) > reach + pair.voxel_size;
  if (is_apart || memory.known_distance(pair) > reach) {
    memory.leave_apart();
    return Status::ok;
  }
  partner.radius = box.radius();
  SideContacts side;
  const Status status = contacts_of_side(pair, partner, query, memory, step.scratch.space, side);
  if (status != Status::ok) return status;
  are_all = side.are_all;
  const Pose& frame = side.in_shell_frame ? shell.pose : field.pose;
  const double* const r = frame.rotation;
  const float farthest = step.options.distance + query.approach.way;
  for (const Contact& contact : side.contacts) {
    if (are_coarse && contact.penetration < -farthest) continue;
    const Vec3 n = contact.inward_normal;
    const Vec3 middle = contact.position + contact.penetration / 2 * n;
    StepContact& out = step.scratch.found.emplace_back();
    const double at[3] = {middle.x, middle.y, middle.z};
    float normal[3];
    for (int i = 0; i < 3; ++i) {
      out.position[i] = frame.translation[i];
      for (int k = 0; k < 3; ++k) out.position[i] += r[3 * i + k] * at[k];
      normal[i] = sign * static_cast<float>(r[3 * i] * n.x + r[3 * i + 1] * n.y + r[3 * i + 2] * n.z);
    }
    out.normal = {normal[0], normal[1], normal[2]};
    out.penetration = contact.penetration;
    out.area = contact.area;
    out.feature = contact.point | (sign < 0 ? kOfSecond : 0);
  }
  return status;
}

}  // namespace

Status step_contacts(const StepBody& first, const StepBody& second, const StepOptions& options, StepScratch& scratch,
                     std::span<StepContact>& contacts) noexcept {
  const std::span<StepContact> out = contacts;
  contacts = {};
  if (out.empty() || !(options.distance >= 0) || !std::isfinite(options.distance)) return Status::bad_argument;
  for (const StepBody* const body : {&first, &second}) {
    if (const Status status = check_pose(body->pose); status != Status::ok) return status;
    if (body->motion != nullptr && !is_finite(*body->motion)) return Status::bad_argument;
  }
  const PairRoles roles = roles_of(side_of(first), side_of(second));
  if (!roles.is_possible) return Status::missing_part;
  // Springs act on the areas of one body's points.
  const bool both = roles.both_give && options.use != StepUse::springs;
  Status status = Status::ok;
  const Status grown = try_to_grow([&] {
    if (scratch.content == nullptr) scratch.content = std::make_unique<StepScratch::Content>();
    StepMemory* const memory = options.memory;
    if (memory != nullptr && memory->content == nullptr) memory->content = std::make_unique<StepMemory::Content>();
    const BothSides step{options, both, out.size(), *scratch.content};
    std::vector<StepContact>& found = scratch.content->found;
    found.clear();
    bool are_all = false;
    const auto add = [&](bool of_first) {
      const StepBody& shell = of_first ? first : second;
      const StepBody& field = of_first ? second : first;
      const float sign = of_first ? 1 : -1;
      if (memory != nullptr) {
        StepMemory::Content::Side& side = memory->content->sides[of_first ? 0 : 1];
        if (const std::uint64_t bodies = id_of(shell, field); side.bodies != bodies) side = {{}, bodies};
        return add_side(step, shell, field, sign, side.memory, are_all);
      }
      PairMemory none;
      none.is_lasting = false;
      return add_side(step, shell, field, sign, none, are_all);
    };
    status = add(roles.first_gives);
    if (status == Status::ok && both) {
      if (!are_all) {
        status = add(!roles.first_gives);
      } else if (memory != nullptr) {
        memory->content->sides[roles.first_gives ? 1 : 0].memory.leave_apart();
      }
    }
    if (status != Status::ok) return;
    const float alike = 0.02F * std::min(voxel_of(first), voxel_of(second));
    const auto penetration = [&](std::size_t i) { return found[i].penetration; };
    const auto squared = [&](std::size_t i, std::size_t k) {
      const auto along = [&](int axis) { return found[i].position[axis] - found[k].position[axis]; };
      return static_cast<float>(along(0) * along(0) + along(1) * along(1) + along(2) * along(2));
    };
    detail::Workspace& space = scratch.content->space;
    space.chosen.clear();
    choose_more(found.size(), penetration, squared, alike, out.size(), space.nearest, space.chosen);
    contacts = out.first(space.chosen.size());
    std::transform(space.chosen.begin(), space.chosen.end(), out.begin(), [&](std::uint32_t i) { return found[i]; });
  });
  return grown != Status::ok ? grown : status;
}

}  // namespace vps
