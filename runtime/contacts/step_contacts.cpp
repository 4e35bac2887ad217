// SPDX-License-Identifier: Zlib
// The contacts of a pair for a step, for engines that describe their bodies as StepBody: chooses the roles of the
// bodies and gathers the contacts of both. Paper: Secs. 2.3 and 3.2.
#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "runtime/contacts/gives_pointshell.h"
#include "runtime/contacts/side_contacts.h"
#include "runtime/grow.h"

namespace vps {
struct StepMemory::Content {
  detail::PairMemory sides[2];  // the first body's points, the second's
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
bool has_points(const StepBody& body) noexcept {
  return body.shell != nullptr && body.shell->points > 0;
}
bool has_field(const StepBody& body) noexcept {
  return body.field.voxelmap() == nullptr || map_of(body) != nullptr;
}
float voxel_of(const StepBody& body) noexcept {
  const VoxelmapView* const map = map_of(body);
  if (map != nullptr) return map->voxel_size;
  // A shell alone: points are about a voxel and a half apart.
  return has_points(body) ? body.shell->covering_radius : std::numeric_limits<float>::infinity();
}

bool gives_points(const StepBody& first, const StepBody& second) noexcept {
  return gives_pointshell({voxel_of(first), first.shell->points}, {voxel_of(second), second.shell->points});
}

// Half the diagonal of a body's box. [m]
float radius_of(FieldRef field) noexcept {
  return field.visit([](const auto& body) {
    using Kind = std::remove_cvref_t<decltype(body)>;
    if constexpr (std::is_same_v<Kind, VoxelmapView>) {
      const auto side = [&](int axis) { return (body.bounds_max[axis] - body.bounds_min[axis]) / 2; };
      return detail::length(Vec3{side(0), side(1), side(2)});
    } else if constexpr (std::is_same_v<Kind, BoxField>) {
      return detail::length(body.half_extents);
    } else if constexpr (std::is_same_v<Kind, SphereField>) {
      return detail::length(Vec3{body.radius, body.radius, body.radius});
    } else if constexpr (std::is_same_v<Kind, RevolvedField>) {
      const float out = body.radius + body.rounding;
      const bool is_capsule = body.profile == RevolvedField::Profile::capsule;
      return detail::length(Vec3{out, out, body.half_height + (is_capsule ? out : body.rounding)});
    } else {
      return std::numeric_limits<float>::infinity();
    }
  });
}

std::array<Vec3, 8> corners_of(Vec3 h) noexcept {
  std::array<Vec3, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    corners[i] = {(i & 1) != 0 ? h.x : -h.x, (i & 2) != 0 ? h.y : -h.y, (i & 4) != 0 ? h.z : -h.z};
  }
  return corners;
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
Status add_side(const BothSides& step, const StepBody& shell, const StepBody& field, float sign, PairMemory& memory) {
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
  field.field.visit([&](const auto& body) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(body)>, BoxField>) {
      corners = corners_of(body.half_extents);
      partner.corners.places = corners;
    }
  });
  SideQuery query{step.options.distance, step.both};
  query.approach = approach(pair);
  query.most = step.most;
  if (memory.knows_apart(pair, double{query.distance + query.approach.way})) {
    memory.leave_apart();
    return Status::ok;
  }
  if (query.approach.way > 0) partner.radius = radius_of(field.field);
  SideContacts side;
  const Status status = contacts_of_side(pair, partner, query, memory, step.scratch.space, side);
  if (status != Status::ok) return status;
  const Pose& frame = side.in_shell_frame ? shell.pose : field.pose;
  const double* const r = frame.rotation;
  for (const Contact& contact : side.contacts) {
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
  const bool first_can = has_points(first) && has_field(second);
  const bool second_can = has_points(second) && has_field(first);
  if (!first_can && !second_can) return Status::missing_part;
  const bool by_first = first_can && (!second_can || gives_points(first, second));
  const StepBody& giver = by_first ? first : second;
  const StepBody& other = by_first ? second : first;
  // Springs act on the areas of one body's points.
  const bool both = first_can && second_can && giver.shell->face_points != nullptr && options.use != StepUse::springs;
  Status status = Status::ok;
  const Status grown = try_to_grow([&] {
    if (scratch.content == nullptr) scratch.content = std::make_unique<StepScratch::Content>();
    StepMemory* const memory = options.memory;
    if (memory != nullptr && memory->content == nullptr) memory->content = std::make_unique<StepMemory::Content>();
    const BothSides step{options, both, out.size(), *scratch.content};
    std::vector<StepContact>& found = scratch.content->found;
    found.clear();
    const auto add = [&](bool of_first) {
      const StepBody& shell = of_first ? first : second;
      const StepBody& field = of_first ? second : first;
      const float sign = of_first ? 1 : -1;
      if (memory != nullptr) return add_side(step, shell, field, sign, memory->content->sides[of_first ? 0 : 1]);
      PairMemory none;
      none.is_lasting = false;
      return add_side(step, shell, field, sign, none);
    };
    status = add(by_first);
    if (status == Status::ok && both) status = add(!by_first);
    if (status != Status::ok) return;
    const float alike = 0.02F * std::min(voxel_of(giver), voxel_of(other));
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
