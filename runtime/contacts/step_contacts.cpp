// SPDX-License-Identifier: Zlib
// The contacts of a pair for a step, for any engine: roles, points in contact, a few of them, their places. Paper:
// Secs. 2.3 and 3.2.
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "runtime/contacts/between_samples.h"
#include "runtime/contacts/corner_contacts.h"
#include "runtime/contacts/find_hits.h"
#include "runtime/contacts/gives_pointshell.h"
#include "runtime/contacts/refine_contact.h"
#include "runtime/contacts/round_contacts.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"
#include "runtime/grow.h"
#include "runtime/vps_contacts.h"

namespace vps {
namespace detail {

/// What one body's points in the other leave for the next step.
struct SideMemory {
  ContactCache cache;
  std::array<std::uint32_t, 4> chosen{};  // features
  std::size_t count = 0;
};

}  // namespace detail

struct StepMemory::Content {
  detail::SideMemory sides[2];  // the first body's points, the second's
};
StepMemory::StepMemory() noexcept = default;
StepMemory::StepMemory(StepMemory&& other) noexcept = default;
StepMemory& StepMemory::operator=(StepMemory&& other) noexcept = default;
StepMemory::~StepMemory() = default;

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

// One body's points in the other one's field. Contacts are in the field's frame.
struct Side {
  const StepBody& shell;
  const StepBody& field;
  const StepOptions& options;
  bool leaves_faces = false;
  SideMemory* memory = nullptr;
  StepScratch& space;
  std::size_t most = 0;
  Pose pose = relative_pose(field.pose, shell.pose);
  float alike = 0.02F * std::min(voxel_of(shell), voxel_of(field));  // depths that differ by rounding alone. [m]

  [[nodiscard]] QueryOptions query() const noexcept {
    QueryOptions query;
    query.contact_distance = options.distance;
    query.leaves_faces = leaves_faces;
    query.cache = memory != nullptr ? &memory->cache : nullptr;
    return query;
  }
  [[nodiscard]] Transform to_shell() const noexcept { return Transform(relative_pose(shell.pose, field.pose)); }
};

// How well a contact completes those chosen: deep, and far from them. One that does not touch yet carries no load,
// however far out it lies.
// @param squared  distance from the nearest one chosen. [m^2]
float worth(float penetration, float squared, float alike) noexcept {
  const float off = alike * alike * alike / (penetration * penetration + alike * alike);
  return squared * (penetration >= 0 ? penetration + alike : off);
}

// Chooses more contacts than four by their worth.
// @param chosen  four or fewer on entry
void choose_more(const ContactRows& rows, float alike, std::size_t most, StepScratch& space) {
  std::vector<std::uint32_t>& chosen = space.chosen;
  std::fill_n(space.nearest.begin(), rows.count, std::numeric_limits<float>::max());
  for (std::size_t done = 0; done < chosen.size(); ++done) {
    const std::uint32_t last = chosen[done];
    const float at[3] = {rows.position[0][last], rows.position[1][last], rows.position[2][last]};
    for (std::uint32_t i = 0; i < rows.count; ++i) {
      const float x = rows.position[0][i] - at[0];
      const float y = rows.position[1][i] - at[1];
      const float z = rows.position[2][i] - at[2];
      space.nearest[i] = std::min(space.nearest[i], x * x + y * y + z * z);
    }
    if (done + 1 < chosen.size() || chosen.size() == most) continue;
    float best = 0;
    std::uint32_t next = 0;
    for (std::uint32_t i = 0; i < rows.count; ++i) {
      const float value = worth(rows.penetration[i], space.nearest[i], alike);
      if (!(value > best)) continue;
      best = value;
      next = i;
    }
    if (best > 0) chosen.push_back(next);
  }
}

// Contacts of the shell's points, few of many.
// @param extra  contacts that compete with them; they are final
Status choose_points(const Side& side, std::span<const Contact> extra, float least) {
  const PointshellView& shell = *side.shell.shell;
  StepScratch& space = side.space;
  ContactRows rows;
  float bound = 0;
  const Status status = find_hits(shell, side.field.field, side.pose, side.query(), space.scratch, rows, bound);
  if (status != Status::ok) return status;
  if (least > -std::numeric_limits<float>::infinity()) keep_deeper(least, rows);
  for (const Contact& contact : extra) {
    rows.position[0][rows.count] = contact.position.x;
    rows.position[1][rows.count] = contact.position.y;
    rows.position[2][rows.count] = contact.position.z;
    rows.penetration[rows.count] = contact.penetration;
    rows.feature[rows.count++] = contact.point;
  }
  std::array<std::uint32_t, 4> four{};
  const std::span<const std::uint32_t> previous = side.memory != nullptr
                                                      ? std::span(side.memory->chosen).first(side.memory->count)
                                                      : std::span<const std::uint32_t>();
  const std::size_t count = std::min(choose_four(rows, previous, side.alike, four), side.most);
  const auto grow = [&] {
    if (space.nearest.size() < rows.count) space.nearest.resize(rows.count);
    space.chosen.reserve(side.most);
  };
  if (const Status grown = try_to_grow(grow); grown != Status::ok) return grown;
  space.chosen.assign(four.begin(), four.begin() + count);
  if (side.most > four.size()) choose_more(rows, side.alike, side.most, space);
  if (side.memory != nullptr) {
    side.memory->count = count;
    for (std::size_t i = 0; i < count; ++i) side.memory->chosen[i] = rows.feature[four[i]];
  }
  const Transform to_field(side.pose);
  for (const std::uint32_t row : space.chosen) {
    const std::uint32_t point = rows.feature[row];
    if (point >= shell.points) {
      space.few.push_back(extra[row - (rows.count - static_cast<std::uint32_t>(extra.size()))]);
      continue;
    }
    space.few.push_back({to_field.apply(point_position(shell, point)),
                         to_field.rotate(point_inward_normal(shell, point)), rows.penetration[row],
                         point_area(shell, point), point, 0});
  }
  return Status::ok;
}

// All points in contact, in space.contacts, which keeps its size.
Status find_points(const Side& side, std::span<Contact>& found) {
  const PointshellView& shell = *side.shell.shell;
  StepScratch& space = side.space;
  const std::size_t most = std::size_t{shell.points} + shell.facets;
  const auto grow = [&] {
    if (space.contacts.size() < most) space.contacts.resize(most);
  };
  if (const Status status = try_to_grow(grow); status != Status::ok) return status;
  QueryResult result;
  const Status status =
      traverse_contacts(shell, side.field.field, side.pose, side.query(), space.scratch, space.contacts, result);
  found = std::span(space.contacts).first(status == Status::ok ? result.contacts : 0);
  return status;
}

// Gives contacts their final direction and depth.
// @return number of contacts left, without those that are none; they come first
std::size_t refine(const Side& side, std::span<Contact> contacts) {
  const VoxelmapView* const own = map_of(side.shell);
  const VoxelmapView none;
  const ShellBody body{own != nullptr ? *own : none, side.to_shell()};
  const std::uint32_t points = side.shell.shell->points;
  const auto is_none = [&](Contact& contact) {
    if (contact.point >= points) return false;  // final
    return side.field.field.visit([&](const auto& field) {
      using Kind = std::remove_cvref_t<decltype(field)>;
      if constexpr (std::is_same_v<Kind, VoxelmapView>) {
        return settle_on_map(field, body, 0, side.options.distance, contact);
      } else {
        const Vec3 into_shell = contact.inward_normal;
        bool has_face = false;
        if constexpr (std::is_same_v<Kind, BoxField>) {
          has_face = contact.penetration >= 0 && face_shell(faces_of(field), side.alike, contact);
        }
        if (!has_face) contact.inward_normal = normal_at(field, contact.position);
        return settle(field, voxel_of(side.shell) / 2, into_shell, contact);
      }
    });
  };
  return static_cast<std::size_t>(std::remove_if(contacts.begin(), contacts.end(), is_none) - contacts.begin());
}

// Moves contacts to where the bodies overlap most between the shell's points.
void slide(const Side& side, std::vector<Contact>& contacts) {
  const VoxelmapView* const own = map_of(side.shell);
  const VoxelmapView* const other = map_of(side.field);
  if (own == nullptr || own->field == Field::layers || (other != nullptr && other->field == Field::layers)) return;
  std::array<SlidingContact, 64> room;  // more stay where they are
  const std::size_t count = std::min(contacts.size(), room.size());
  for (std::size_t i = 0; i < count; ++i) {
    room[i].at = &contacts[i];
    if (contacts[i].point >= side.shell.shell->points) room[i].kind = SlidingContact::Kind::fixed;
  }
  const std::span<SlidingContact> sliding(room.data(), count);
  Slides slides({own->voxel_size, other != nullptr ? other->voxel_size : 0}, sliding, nullptr);
  if (!slides.recall()) {
    const PlacedField shell(*own, relative_pose(side.shell.pose, side.field.pose));
    const PlacedField field(side.field.field, Pose());
    slides.search({shell, field, own->voxel_size});
  }
  slides.keep();
  std::size_t kept = 0;
  for (const SlidingContact& contact : sliding) {
    if (contact.is_kept) contacts[kept++] = *contact.at;
  }
  contacts.erase(contacts.begin() + static_cast<std::ptrdiff_t>(kept),
                 contacts.begin() + static_cast<std::ptrdiff_t>(count));
}

// Contacts of a sphere or capsule, in the shell's distances.
// @return false where there are no such distances: the shell's points have to do
bool find_round(const Side& side, Vec3 half_axis, float radius, Status& status) {
  const VoxelmapView* const map = map_of(side.shell);
  if (map == nullptr || map->field == Field::layers || !takes_round(*map, radius)) return false;
  const PointshellView& shell = *side.shell.shell;
  const Transform to_shell = side.to_shell();
  const RoundInMap body{to_shell.apply({0, 0, 0}), to_shell.rotate(half_axis), radius};
  const float farthest = sphere_radius(shell, 0) + detail::length(half_axis) + radius + side.options.distance;
  if (!(detail::length(body.centre - sphere_centre(shell, 0)) <= farthest + shell.covering_radius)) return true;
  std::span<Contact> seeds;
  status = find_points(side, seeds);
  if (status != Status::ok) return true;
  StepScratch& space = side.space;
  for (Contact& seed : seeds) {
    seed.position = to_shell.apply(seed.position);
    seed.inward_normal = to_shell.rotate(seed.inward_normal);
  }
  bool is_found = false;
  status = try_to_grow(
      [&] { is_found = find_round_contacts(*map, body, seeds, side.options.distance, shell.points, space.placed); });
  if (!is_found) return status != Status::ok;
  for (const Contact& contact : space.placed) {
    if (space.few.size() == side.most) break;
    space.few.push_back(contact);
    space.few.back().position = Transform(side.pose).apply(contact.position);
    space.few.back().inward_normal = Transform(side.pose).rotate(contact.inward_normal);
  }
  return true;
}

// Contacts of a box's corners in the shell's distances, into space.placed.
Status find_corners(const Side& side, const BoxField& box) {
  const VoxelmapView* const map = map_of(side.shell);
  side.space.placed.clear();
  if (map == nullptr || map->field == Field::layers) return Status::ok;
  const Vec3 h = box.half_extents;
  const std::array<Vec3, 8> corners = {{{-h.x, -h.y, -h.z},
                                        {h.x, -h.y, -h.z},
                                        {-h.x, h.y, -h.z},
                                        {h.x, h.y, -h.z},
                                        {-h.x, -h.y, h.z},
                                        {h.x, -h.y, h.z},
                                        {-h.x, h.y, h.z},
                                        {h.x, h.y, h.z}}};
  return try_to_grow([&] {
    add_corner_contacts(*map, *side.shell.shell, side.to_shell(), {corners, 0}, side.options.distance,
                        side.space.placed);
  });
}

// Few springs with the wrench of all points that press.
Status find_springs(const Side& side) {
  StepScratch& space = side.space;
  std::span<Contact> pressing;
  if (const Status status = find_points(side, pressing); status != Status::ok) return status;
  const auto is_off = [](const Contact& contact) { return !(contact.penetration >= 0); };
  pressing = {pressing.begin(), std::remove_if(pressing.begin(), pressing.end(), is_off)};
  pressing = pressing.first(refine(side, pressing));
  const PointshellView& shell = *side.shell.shell;
  const Vec3 centre =
      Transform(side.pose).apply({shell.centre_of_mass[0], shell.centre_of_mass[1], shell.centre_of_mass[2]});
  if (const Status status = try_to_grow([&] { space.few.resize(side.most); }); status != Status::ok) return status;
  Reduction reduction;
  const Status status = reduce_contacts(pressing, centre, space.few, space.reduction, reduction);
  space.few.resize(reduction.kept);
  return status;
}

Status find_few(const Side& side) {
  side.space.few.clear();
  const Status grown = try_to_grow([&] { side.space.few.reserve(side.most); });
  if (grown != Status::ok) return grown;
  if (side.options.use == StepUse::springs) return find_springs(side);
  Status status = Status::ok;
  const bool is_done = side.field.field.visit([&](const auto& field) {
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, SphereField>) return find_round(side, {}, field.radius, status);
    if constexpr (std::is_same_v<Kind, RevolvedField>) {
      if (field.profile == RevolvedField::Profile::capsule && field.rounding == 0)
        return find_round(side, {0, 0, field.half_height}, field.radius, status);
    }
    side.space.placed.clear();
    if constexpr (std::is_same_v<Kind, BoxField>) status = find_corners(side, field);
    return status != Status::ok;
  });
  if (is_done) return status;
  const float near = 5 * side.alike;
  status = choose_points(side, side.space.placed, least_beside(side.space.placed, near));
  if (status != Status::ok) return status;
  side.space.few.resize(refine(side, side.space.few));
  if (side.options.use == StepUse::constraints && !side.space.few.empty()) slide(side, side.space.few);
  return status;
}

// Adds the contacts of a side to those of the pair, in the world.
// @param sign  of the normal: 1 where the shell's body is the first
Status add_side(const Side& side, float sign) {
  if (const Status status = find_few(side); status != Status::ok) return status;
  const double* const r = side.field.pose.rotation;
  const auto add = [&] {
    for (const Contact& contact : side.space.few) {
      const Vec3 n = contact.inward_normal;
      const Vec3 middle = contact.position + contact.penetration / 2 * n;
      StepContact& out = side.space.found.emplace_back();
      const double at[3] = {middle.x, middle.y, middle.z};
      float normal[3];
      for (int i = 0; i < 3; ++i) {
        out.position[i] = side.field.pose.translation[i];
        for (int k = 0; k < 3; ++k) out.position[i] += r[3 * i + k] * at[k];
        normal[i] = sign * static_cast<float>(r[3 * i] * n.x + r[3 * i + 1] * n.y + r[3 * i + 2] * n.z);
      }
      out.normal = {normal[0], normal[1], normal[2]};
      out.penetration = contact.penetration;
      out.area = contact.area;
      out.feature = contact.point | (sign < 0 ? kOfSecond : 0);
    }
  };
  return try_to_grow(add);
}

// The best contacts first: the deepest, then by their worth.
// @return how many
std::size_t put_best_first(std::vector<StepContact>& found, float alike, StepScratch& space,
                           std::span<StepContact> out) {
  std::vector<float>& nearest = space.nearest;
  nearest.assign(found.size(), std::numeric_limits<float>::max());
  std::size_t count = 0;
  while (count < std::min(out.size(), found.size())) {
    std::size_t next = found.size();
    float best = -std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (nearest[i] < 0) continue;
      const float value = count == 0 ? found[i].penetration : worth(found[i].penetration, nearest[i], alike);
      if (next < found.size() && !(value > best)) continue;
      best = value;
      next = i;
    }
    out[count++] = found[next];
    nearest[next] = -1;
    for (std::size_t i = 0; i < found.size(); ++i) {
      double squared = 0;
      for (int k = 0; k < 3; ++k) {
        const double along = found[i].position[k] - found[next].position[k];
        squared += along * along;
      }
      if (nearest[i] >= 0) nearest[i] = std::min(nearest[i], static_cast<float>(squared));
    }
  }
  return count;
}

}  // namespace

Status step_contacts(const StepBody& first, const StepBody& second, const StepOptions& options, StepScratch& scratch,
                     std::span<StepContact>& contacts) noexcept {
  const std::span<StepContact> out = contacts;
  contacts = {};
  if (out.empty() || !(options.distance >= 0) || !std::isfinite(options.distance)) return Status::bad_argument;
  for (const StepBody* const body : {&first, &second}) {
    if (const Status status = check_pose(body->pose); status != Status::ok) return status;
  }
  const bool first_can = has_points(first) && has_field(second);
  const bool second_can = has_points(second) && has_field(first);
  if (!first_can && !second_can) return Status::missing_part;
  StepMemory* const memory = options.memory;
  if (memory != nullptr && memory->content == nullptr) {
    const Status status = try_to_grow([&] { memory->content = std::make_unique<StepMemory::Content>(); });
    if (status != Status::ok) return status;
  }
  const bool by_first = first_can && (!second_can || gives_points(first, second));
  const StepBody& giver = by_first ? first : second;
  const StepBody& other = by_first ? second : first;
  // Springs act on the areas of one body's points.
  const bool both = first_can && second_can && giver.shell->face_points != nullptr && options.use != StepUse::springs;
  const auto add = [&](bool of_first) {
    SideMemory* const of_side = memory != nullptr ? &memory->content->sides[of_first ? 0 : 1] : nullptr;
    return add_side({of_first ? first : second, of_first ? second : first, options, both, of_side, scratch, out.size()},
                    of_first ? 1.0F : -1.0F);
  };
  scratch.found.clear();
  if (const Status status = add(by_first); status != Status::ok) return status;
  if (both) {
    if (const Status status = add(!by_first); status != Status::ok) return status;
  }
  const float alike = 0.02F * std::min(voxel_of(giver), voxel_of(other));
  return try_to_grow([&] { contacts = out.first(put_best_first(scratch.found, alike, scratch, out)); });
}

}  // namespace vps
