// SPDX-License-Identifier: Zlib
// Looks up the corners in the other body's distance field: the roles of the paper's Sec. 3.2 exchanged for few points.
#include "runtime/contacts/baked_corners.h"

#include <algorithm>
#include <array>
#include <limits>

#include "runtime/contacts/refine_contact.h"
#include "runtime/contacts/side_contacts.h"
#include "runtime/fields/placed_field.h"

namespace vps::detail {
namespace {

// Upper bound of V outside the map's mesh, from its bounds; infinite within them. [m]
float most_beside(const VoxelmapView& map, Vec3 p) {
  const auto outside = [](float at, float low, float high) { return std::max(low - at, at - high); };
  const float off =
      std::max({outside(p.x, map.bounds_min[0], map.bounds_max[0]), outside(p.y, map.bounds_min[1], map.bounds_max[1]),
                outside(p.z, map.bounds_min[2], map.bounds_max[2])});
  return off > 0 ? -off : std::numeric_limits<float>::infinity();
}

// Finds the corners with V of at least `least`.
class FindCorners {
 public:
  FindCorners(const StepPair& pair, const VoxelmapView& map, float least, std::vector<Contact>& contacts)
      : pair_(pair), map_(map), least_(least), contacts_(contacts) {
    const PointshellView& shell = pair.shell;
    const Transform to_map(pair.shell_to_field);
    for (std::uint32_t i = 0; i < shell.corners; ++i) {
      const std::uint32_t point = shell.corner_points[i];
      const Vec3 at = to_map.apply(point_position(shell, point));
      if (const float bound = most_beside(map, at); bound < least) {
        most_ = std::max(most_, bound);
        continue;
      }
      points_[places_.count] = point;
      places_.push(at);
      if (places_.count == Places::kMost) look_up();
    }
    if (places_.count > 0) look_up();
  }
  // Upper bound of V at all corners. [m]
  [[nodiscard]] float most() const { return most_; }

 private:
  void look_up() {
    Values v;
    PlacedField(map_, Pose()).penetrations(places_, v);
    for (std::uint32_t i = 0; i < places_.count; ++i) {
      most_ = std::max(most_, v[i]);
      if (!(v[i] >= least_)) continue;
      // The normals of the corner's own sides say nothing of where it meets a face.
      const Vec3 at = places_[i];
      const MapPlace place = place_in_map(map_, at);
      if (!(place.penetration >= least_) || !(dot(place.outward, place.outward) > 0)) continue;
      contacts_.push_back(
          {at, place.outward, place.penetration + pair_.margin, point_area(pair_.shell, points_[i]), points_[i], 0});
    }
    places_.count = 0;
  }

  const StepPair& pair_;
  const VoxelmapView& map_;
  const float least_;
  std::vector<Contact>& contacts_;
  float most_ = -std::numeric_limits<float>::infinity();
  Places places_;  // that wait for their look-up, map's frame. [m]
  std::array<std::uint32_t, Places::kMost> points_;
};

}  // namespace

std::span<ManifoldContact> contacts_of_corners(const StepPair& pair, const VoxelmapView& map, const CornersQuery& query,
                                               PairMemory& memory, Workspace& space) {
  std::vector<ManifoldContact>& few = space.few;
  few.clear();
  const float reach = query.distance + pair.margin + query.approach.way;
  const float least = std::max(-reach, query.least - pair.margin);
  GapMemory& gap = memory.gap;
  if (motion_between(pair.shell, gap.stand, pair.shell_to_field) < gap.distance + double{least}) return few;
  std::vector<Contact>& contacts = space.on_map;
  contacts.clear();
  gap.distance = -double{FindCorners(pair, map, least, contacts).most()};
  gap.stand = pair.shell_to_field;
  FoundContacts found;
  found.contacts = contacts;
  found.refined = FoundContacts::Refined::all;
  found.shell_points = pair.shell.points;
  found.way = query.approach.way;
  found.is_joint = query.approach.is_joint;
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
  for (const std::uint32_t i : space.chosen) few.push_back({all[i], all[i].point});
  return few;
}

}  // namespace vps::detail
