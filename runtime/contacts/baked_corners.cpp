// SPDX-License-Identifier: Zlib
// Looks up the corners in the distance field of the shell's body: the roles of the paper's Sec. 3.2 exchanged for few
// places.
#include "runtime/contacts/baked_corners.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/contacts/side_contacts.h"
#include "runtime/fields/placed_field.h"

namespace vps::detail {
namespace {

Vec3 corner_of(const VoxelmapView& map, std::uint32_t i) {
  const float* const at = map.corner_places + 3 * std::size_t{i};
  return map.scale * Vec3{at[0], at[1], at[2]};
}

// Upper bound of V outside the mesh's bounds; infinite within them. [m]
float most_beside(const VoxelmapView& map, Vec3 p) {
  const auto outside = [](float at, float low, float high) { return std::max(low - at, at - high); };
  const float off =
      std::max({outside(p.x, map.bounds_min[0], map.bounds_max[0]), outside(p.y, map.bounds_min[1], map.bounds_max[1]),
                outside(p.z, map.bounds_min[2], map.bounds_max[2])});
  return off > 0 ? -off : std::numeric_limits<float>::infinity();
}

// Finds the corners with V of at least `least`, without the margins.
class FindCorners {
 public:
  // @param contacts  null: only the bounds are wanted
  FindCorners(const StepPair& pair, const VoxelmapView& map, float least, std::vector<Contact>* contacts)
      : pair_(pair), map_(map), to_shell_(pair.to_shell()), least_(least), contacts_(contacts) {
    for (std::uint32_t i = 0; i < map.corners; ++i) {
      const Vec3 at = to_shell_.apply(corner_of(map, i));
      if (const float bound = most_beside(pair.distances, at); bound < least) {
        take(bound, at);
        continue;
      }
      numbers_[places_.count] = i;
      places_.push(at);
      if (places_.count == Places::kMost) look_up();
    }
    if (places_.count > 0) look_up();
  }
  // Upper bound of V at all corners. [m]
  [[nodiscard]] float most() const { return most_; }
  // See most_of_corners.
  [[nodiscard]] float most_moving() const { return most_moving_; }

 private:
  void look_up() {
    Values v;
    PlacedField(pair_.distances, Pose()).penetrations(places_, v);
    for (std::uint32_t i = 0; i < places_.count; ++i) {
      take(v[i], places_[i]);
      if (contacts_ == nullptr || !(v[i] >= least_)) continue;
      add_corner_contact(pair_.distances, to_shell_, corner_of(map_, numbers_[i]), {least_, pair_.margin},
                         pair_.shell.points + numbers_[i], *contacts_);
    }
    places_.count = 0;
  }

  void take(float v, Vec3 at) {
    most_ = std::max(most_, v);
    const float farther = length(at - sphere_centre(pair_.shell, 0)) / sphere_radius(pair_.shell, 0);
    most_moving_ = std::max(most_moving_, v < 0 && farther > 1 ? v / farther : v);
  }

  const StepPair& pair_;
  const VoxelmapView& map_;
  const Transform to_shell_;
  const float least_;
  std::vector<Contact>* contacts_;
  float most_ = -std::numeric_limits<float>::infinity();
  float most_moving_ = -std::numeric_limits<float>::infinity();
  Places places_;  // that wait for their look-up, shell's frame. [m]
  std::array<std::uint32_t, Places::kMost> numbers_;
};

}  // namespace

float most_of_corners(const StepPair& pair, const VoxelmapView& map, float least) {
  return FindCorners(pair, map, least, nullptr).most_moving();
}

void add_contacts_of_corners(const StepPair& pair, const VoxelmapView& map, const CornersQuery& query,
                             CornerMemory& memory, Workspace& space, std::vector<ManifoldContact>& out) {
  const float least = std::max(-query.distance - query.way, query.least) - pair.margin;
  // Corners move no farther than the box that holds them.
  const Vec3 low{map.bounds_min[0], map.bounds_min[1], map.bounds_min[2]};
  const Vec3 high{map.bounds_max[0], map.bounds_max[1], map.bounds_max[2]};
  const Pose to_shell = relative_pose(pair.shell_pose, pair.field_pose);
  if (memory.stand) {
    const double moved = largest_displacement(0.5F * (low + high), 0.5F * length(high - low), *memory.stand, to_shell);
    if (double{memory.most} + moved < double{least}) return;
  }
  std::vector<Contact>& contacts = space.on_map;
  contacts.clear();
  memory.most = FindCorners(pair, map, least, &contacts).most();
  memory.stand = to_shell;
  FoundContacts found;
  found.contacts = contacts;
  found.has_map_contacts = true;
  found.shell_points = pair.shell.points;
  found.way = query.way;
  found.is_joint = query.is_joint;
  if (found.way > 0 && !contacts.empty()) keep_arriving(pair, Partner{map}, found);
  const std::span<const Contact> all = found.contacts;
  space.chosen.clear();
  choose_more(
      all.size(), [&](std::size_t i) { return all[i].penetration; },
      [&](std::size_t i, std::size_t k) {
        const Vec3 between = all[i].position - all[k].position;
        return dot(between, between);
      },
      pair.alike(), query.most, space.nearest, space.chosen);
  for (const std::uint32_t i : space.chosen) out.push_back({all[i], all[i].point});
}

}  // namespace vps::detail
