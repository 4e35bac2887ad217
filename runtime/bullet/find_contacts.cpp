// SPDX-License-Identifier: Zlib
// Finds contacts with each kind of partner.
#include "runtime/bullet/find_contacts.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include "runtime/bullet/arriving_contacts.h"
#include "runtime/bullet/partners/corner_contacts.h"
#include "runtime/bullet/partners/partner_field.h"
#include "runtime/bullet/refine_contacts.h"
#include "runtime/contacts/round_contacts.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"
#include "runtime/fields/place_field.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {

using detail::operator+;
using detail::operator-;
using detail::operator*;

Workspace& Workspace::of_this_thread(const PointshellView& shell) {
  thread_local Workspace space;
  if (space.contacts.size() < shell.points) space.contacts.resize(shell.points);
  return space;
}

namespace {

float penetration_at(const VoxelmapView& map, Vec3 p, Vec3 into_shell) {
  return vps::penetration(map, p, into_shell);
}
template <class Field>
float penetration_at(const Field& field, Vec3 p, Vec3) {
  return detail::value_at(field, p);
}

// A segment farther off the surface is about to land, and its deepest point is enough. With more contacts, 10
// iterations of the solver do not suffice.
constexpr btScalar kTouching_vx = 8;

// Largest distance off the surface of a contact, and of a segment that touches. [m]
struct Reach {
  float contact, touching;
};

// Where a point of a segment is now.
template <class Field>
Contact contact_at(const PointshellView& shell, const Field& field, const detail::Transform& to_field,
                   const SegmentPoint& old) {
  const Vec3 position = to_field.apply(point_position(shell, old.point));
  const Vec3 into_shell = to_field.rotate(point_inward_normal(shell, old.point));
  return {position,  into_shell, penetration_at(field, position, into_shell), point_area(shell, old.point),
          old.point, old.node};
}

void sort_by_segments(std::span<Contact> contacts) {
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& a, const Contact& b) { return std::pair(a.node, a.point) < std::pair(b.node, b.point); });
}

// Tests again the points where a segment was in contact in the last step, if it still touches.
// @param contacts  `found` contacts of the query, and room for more
// @return number of contacts, which are in tree order
template <class Field>
std::size_t test_again(const PointshellView& shell, const Field& field, const Pose& pose, Reach reach,
                       std::span<const SegmentPoint> before, std::span<Contact> contacts, std::size_t found) {
  const detail::Transform to_field(pose);
  std::size_t count = found;
  for (const SegmentPoint& old : before) {
    const auto deepest = std::find_if(contacts.begin(), contacts.begin() + found,
                                      [&](const Contact& contact) { return contact.node == old.node; });
    const bool touches = deepest != contacts.begin() + found && deepest->penetration >= -reach.touching;
    if (!touches || deepest->point == old.point || count == contacts.size()) continue;
    contacts[count] = contact_at(shell, field, to_field, old);
    if (contacts[count].penetration >= -reach.contact) ++count;
  }
  if (count > found) sort_by_segments(contacts.first(count));
  return count;
}

// Tests only the points that the segments kept in the last step.
// @return false if one of them is no longer in contact
template <class Field>
bool test_only(const PointshellView& shell, const Field& field, const Pose& pose, Reach reach,
               std::span<const SegmentPoint> before, std::span<Contact> contacts) {
  const detail::Transform to_field(pose);
  for (std::size_t i = 0; i < before.size(); ++i) {
    contacts[i] = contact_at(shell, field, to_field, before[i]);
    if (!(contacts[i].penetration >= -reach.contact)) return false;
  }
  sort_by_segments(contacts.first(before.size()));
  return true;
}

// What every partner's query needs.
struct FieldQuery {
  const Pair& pair;
  QueryOptions options;  // with the margins and the cache
  float margin = 0;      // [m]
  PairMemory& memory;
  Workspace& space;
  bool chooses = false;  // few contacts for a manifold
};

// Whether the points in contact need nothing but their depth before some are chosen. Those of bodies without faces have
// none, and those with round bodies are seeds of others.
bool has_hits_only(const PolytopeField&, const ConvexPlanes& planes) {
  return planes.has_faces();
}
constexpr bool has_hits_only(const SphereField&, const ConvexPlanes&) {
  return false;
}
bool has_hits_only(const RevolvedField& field, const ConvexPlanes&) {
  return field.profile != RevolvedField::Profile::capsule;
}
template <class Field>
constexpr bool has_hits_only(const Field&, const ConvexPlanes&) {
  return true;
}

// Gives hits the V of the body where its planes only bound it, and removes those that are no contacts.
template <class Field>
void keep_hits(const FieldQuery&, const Field&, detail::ContactRows&) {}
void keep_hits(const FieldQuery& query, const PolytopeField&, detail::ContactRows& hits) {
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < hits.count; ++i) {
    const Vec3 place{hits.position[0][i], hits.position[1][i], hits.position[2][i]};
    const float v = query.memory.planes.penetration(place, hits.penetration[i]);
    if (!(v >= -query.options.contact_distance)) continue;
    for (float* const row : hits.position) row[kept] = row[i];
    hits.feature[kept] = hits.feature[i];
    hits.penetration[kept++] = v;
  }
  hits.count = kept;
}

// Whether a choice of contacts holds: the pair stands still. No others are sought then, unless one has left.
bool holds(const FieldQuery& query, const FoundContacts& found) {
  constexpr float kAlike = 1.001F;  // the way of a step is never quite the same
  const ChoiceMemory& choice = query.memory.choice;
  return found.reach <= kAlike * choice.reach && stands_still(query.pair, choice.stand, query.memory.now);
}
std::span<const ContactPlace> chosen_before(const FieldQuery& query, const FoundContacts& found) {
  const ChoiceMemory& choice = query.memory.choice;
  const bool is_known = query.chooses && choice.count > 0 && holds(query, found);
  return is_known ? choice.chosen() : std::span<const ContactPlace>();
}

// Finds points in contact.
template <class Field>
Status find_rows(const FieldQuery& query, const Field& field, const Pose& pose, FoundContacts& found) {
  const PointshellView& shell = query.pair.shell.vps->pointshell();
  if (const std::span<const ContactPlace> known = chosen_before(query, found); !known.empty()) {
    std::array<std::uint32_t, MANIFOLD_CACHE_SIZE> points{};
    std::transform(known.begin(), known.end(), points.begin(), [](const ContactPlace& place) { return place.feature; });
    const Status status = detail::find_hits_of({points.data(), known.size()}, shell, field, pose, query.options,
                                               query.space.scratch, found.hits);
    keep_hits(query, field, found.hits);
    found.are_known = found.hits.count == known.size();
    if (status != Status::ok || found.are_known) return status;
  }
  const Status status =
      detail::find_hits(shell, field, pose, query.options, query.space.scratch, found.hits, found.most);
  keep_hits(query, field, found.hits);
  return status;
}

// @param frame  pose of the field's frame in its shape's frame
template <class Field>
Status find_in_field(const FieldQuery& query, const Field& field, const btTransform& frame, FoundContacts& found) {
  const Pair& pair = query.pair;
  const PointshellView& shell = pair.shell.vps->pointshell();
  const Pose shell_pose = to_pose(pair.shell.world, pair.shell.asset_frame());
  const Pose pose = relative_pose(to_pose(pair.field.world, frame), shell_pose);
  found.frame = pair.field.world * frame;
  QueryOptions options = query.options;
  if (query.chooses && has_hits_only(field, query.memory.planes)) {
    found.shell_to_frame = pose;
    return find_rows(query, field, pose, found);
  }
  if constexpr (std::is_same_v<Field, PolytopeField>) {
    // Planes of a body without faces change from query to query.
    if (!query.memory.planes.has_faces()) options.cache = nullptr;
  }
  std::vector<Contact>& contacts = query.space.contacts;
  const Reach reach{query.options.contact_distance, query.margin + static_cast<float>(kTouching_vx * voxel_size(pair))};
  const std::span<const SegmentPoint> segments = query.memory.segments.points;
  if (!segments.empty() && holds(query, found) && test_only(shell, field, pose, reach, segments, contacts)) {
    found.contacts = {contacts.data(), segments.size()};
    found.are_known = true;
    return Status::ok;
  }
  query.memory.choice = {query.memory.now, found.reach, {}, 0};
  QueryResult result;
  const Status status = [&] {
    if (!(found.way > 0)) {
      return detail::traverse_contacts(shell, field, pose, options, query.space.scratch, contacts, result);
    }
    options.contact_distance -= found.way;
    // The ways of bodies that move together may have any direction.
    const detail::RelativeMotion motion =
        found.is_joint ? detail::RelativeMotion{{found.way, 0, 0}, {}} : motion_in(pair, found.step, found.frame);
    return detail::traverse_ahead(shell, field, pose, options, motion, query.space.scratch, contacts, result);
  }();
  if (status != Status::ok) return status;
  const std::size_t count = test_again(shell, field, pose, reach, segments, contacts, result.contacts);
  found.contacts = {contacts.data(), count};
  return status;
}

Status find_on_triangles(const FieldQuery& query, FoundContacts& found) {
  const Pair& pair = query.pair;
  TriangleContacts& triangles = query.space.triangles;
  const Status status =
      find_triangle_contacts(pair, query.options, chosen_before(query, found), query.memory.triangles, triangles);
  found.are_known = triangles.are_known;
  found.contacts = triangles.contacts;
  found.features = triangles.features;
  found.triangles = triangles.triangles;
  found.frame = pair.shell.world * pair.shell.asset_frame();
  found.refined = FoundContacts::Refined::all;
  return status;
}

// Replaces points of the shell that touch a sphere or capsule by places on the shell's own distance field.
// @param half_axis  field's frame. [m]
void use_distances(const FieldQuery& query, Vec3 half_axis, float radius, FoundContacts& found) {
  const Pair& pair = query.pair;
  const Shape& shape = *pair.shell.vps;
  if (!detail::takes_round(shape.distances(), radius)) return;
  const detail::Transform to_map = to_asset(pair, found.frame);
  std::vector<Contact>& seeds = query.space.seeds;
  seeds.assign(found.contacts.begin(), found.contacts.end());
  for (Contact& seed : seeds) {
    seed.position = to_map.apply(seed.position);
    seed.inward_normal = to_map.rotate(seed.inward_normal);
  }
  const detail::RoundInMap in_map{to_map.apply({0, 0, 0}), to_map.rotate(half_axis), radius};
  std::vector<Contact>& contacts = query.space.on_map;
  if (!detail::find_round_contacts(shape.distances(), in_map, seeds, query.options.contact_distance, found.shell_points,
                                   contacts)) {
    return;
  }
  found.has_map_contacts = true;
  found.contacts = contacts;
  found.frame = pair.shell.world * pair.shell.asset_frame();
  found.refined = FoundContacts::Refined::all;
}

// Corners may lie between the points of the shell.
void add_corners(const FieldQuery& query, FoundContacts& found) {
  std::vector<Contact>& contacts = query.space.on_map;
  contacts.clear();
  if (!add_corner_contacts(query.pair, found.frame, query.options.contact_distance, contacts)) return;
  found.has_map_contacts = true;
  const float least = detail::least_beside(contacts, static_cast<float>(contact_distance(query.pair)));
  if (least > -std::numeric_limits<float>::infinity()) detail::keep_deeper(least, found.hits);
  std::copy_if(found.contacts.begin(), found.contacts.end(), std::back_inserter(contacts),
               [&](const Contact& contact) { return contact.penetration > least; });
  found.contacts = contacts;
}

Status find_on_partner(const FieldQuery& query, FoundContacts& found) {
  const Pair& pair = query.pair;
  const btVector3 from = pair.field.world.invXform(pair.shell.world.getOrigin());
  return on_partner(*pair.field.shape, from, query.memory.planes, [&](const auto& field, const btTransform& frame) {
    const Status status = find_in_field(query, field, frame, found);
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field)>, PolytopeField>) {
      const bool has_hits = query.chooses && has_hits_only(field, query.memory.planes);
      if (status == Status::ok && !has_hits) {
        finish_polytope(pair, query.memory.planes, field, query.options.contact_distance, found);
      }
    }
    // Springs act on the areas of points.
    if (status != Status::ok || pair.shell.vps->segment_level() > 0 || foundation_of(pair).stiffness > 0) {
      return status;
    }
    using Kind = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_same_v<Kind, SphereField>) {
      use_distances(query, {}, field.radius, found);
    } else if constexpr (std::is_same_v<Kind, RevolvedField>) {
      if (field.profile == RevolvedField::Profile::capsule) {
        use_distances(query, {0, 0, field.half_height}, field.radius, found);
      }
    } else {
      add_corners(query, found);
    }
    return status;
  });
}

}  // namespace

Status find_contacts(const Pair& pair, QueryOptions options, PairMemory& memory, FoundContacts& found) {
  const PointshellView& shell = pair.shell.vps->pointshell();
  const float margin = margin_of(pair);
  options.contact_distance += margin;
  options.cache = &memory.cache;
  // With a margin contacts press before they are inside.
  if (foundation_of(pair).stiffness > 0 && !(margin > 0)) options.flat_patches = pair.shell.vps->flat_patches();
  memory.segments.belong_to(shell, options.segment_level);
  const bool chooses = options.segment_level == 0 && !(foundation_of(pair).stiffness > 0);
  const FieldQuery query{pair, options, margin, memory, Workspace::of_this_thread(shell), chooses};
  found.shell_points = shell.points;
  Status status{};
  if (pair.field.vps != nullptr) {
    VoxelmapView map = pair.field.vps->voxelmap();
    // Where a point arrives is found later: farther out a bound of its distance is enough.
    if (found.way > 0) map.far.range = std::numeric_limits<float>::max();
    status = find_in_field(query, map, pair.field.asset_frame(), found);
  } else if (is_triangle_mesh(pair.field.shape->getShapeType())) {
    status = find_on_triangles(query, found);
  } else {
    status = find_on_partner(query, found);
  }
  if (status != Status::ok) return status;
  if (margin > 0) {
    for (Contact& contact : found.contacts) contact.penetration += margin;
    for (std::uint32_t i = 0; i < found.hits.count; ++i) found.hits.penetration[i] += margin;
  }
  return status;
}

void remember_choice(const FoundContacts& found, std::span<const std::uint32_t> rows, PairMemory& memory) {
  if (found.are_known) return;
  ChoiceMemory& choice = memory.choice;
  choice.count = 0;
  for (const std::uint32_t row : rows) {
    if (row < found.hits.count) {
      choice.places[choice.count++] = {0, found.hits.feature[row]};
    } else if (!found.triangles.empty()) {
      choice.places[choice.count++] = {found.contacts[row].node, found.features[row]};
    }
  }
  std::sort(choice.places.begin(), choice.places.begin() + choice.count);
  choice.reach = found.reach;
  choice.stand = memory.now;
}

detail::ContactRows rows_of(const PointshellView& shell, const FoundContacts& found) {
  // Beside hits there are no contacts but those of corners.
  static_assert(detail::kMostCorners <= detail::kExtraRows);
  detail::ContactRows rows = found.hits;
  if (rows.count == 0) {
    Workspace& space = Workspace::of_this_thread(shell);
    const std::size_t room = found.contacts.size() + detail::kLanePadding;
    for (std::vector<float>& row : space.rows) {
      if (row.size() < room) row.resize(room);
    }
    if (space.features.size() < room) space.features.resize(room);
    rows = {{space.rows[0].data(), space.rows[1].data(), space.rows[2].data()},
            space.rows[3].data(),
            space.features.data()};
  }
  for (std::size_t i = 0; i < found.contacts.size(); ++i) {
    const Contact& contact = found.contacts[i];
    rows.position[0][rows.count] = contact.position.x;
    rows.position[1][rows.count] = contact.position.y;
    rows.position[2][rows.count] = contact.position.z;
    rows.penetration[rows.count] = contact.penetration;
    rows.feature[rows.count++] = feature_of(found.contacts, found.features, i);
  }
  return rows;
}

ManifoldContact contact_of_row(const PointshellView& shell, const FoundContacts& found, std::uint32_t row) {
  if (row >= found.hits.count) {
    const std::size_t i = row - found.hits.count;
    return {found.contacts[i], feature_of(found.contacts, found.features, i)};
  }
  const detail::Transform transform(found.shell_to_frame);
  const std::uint32_t point = found.hits.feature[row];
  return {{transform.apply(point_position(shell, point)), transform.rotate(point_inward_normal(shell, point)),
           found.hits.penetration[row], point_area(shell, point), point, 0},
          point};
}

}  // namespace vps::bullet
