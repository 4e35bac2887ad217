// SPDX-License-Identifier: Zlib
// Finds contacts with each kind of partner.
#include "runtime/contacts/find_contacts.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include "runtime/contacts/arriving_contacts.h"
#include "runtime/contacts/refine_contacts.h"
#include "runtime/contacts/round_contacts.h"
#include "runtime/contacts/solid_on_plane.h"
#include "runtime/fields/analytic_fields.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {
namespace {

float penetration_at(const VoxelmapView& map, Vec3 p, Vec3 into_shell) {
  return vps::penetration(map, p, into_shell);
}
template <class Field>
float penetration_at(const Field& field, Vec3 p, Vec3) {
  return value_at(field, p);
}

// A segment farther off the surface is about to land, and its deepest point is enough. With more contacts, 10
// iterations of the solver do not suffice.
constexpr float kTouching_vx = 8;

// Largest distance off the surface of a contact, and of a segment that touches. [m]
struct SegmentReach {
  float contact, touching;
};

// Where a point of a segment is now.
template <class Field>
Contact contact_at(const PointshellView& shell, const Field& field, const Transform& to_field,
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
std::size_t test_again(const PointshellView& shell, const Field& field, const Pose& pose, SegmentReach reach,
                       std::span<const SegmentPoint> before, std::span<Contact> contacts, std::size_t found) {
  const Transform to_field(pose);
  std::size_t count = found;
  const std::span<const Contact> of_segments = contacts.first(found);  // in tree order
  for (const SegmentPoint& old : before) {
    const auto deepest =
        std::lower_bound(of_segments.begin(), of_segments.end(), old.node,
                         [](const Contact& contact, std::uint32_t node) { return contact.node < node; });
    const bool touches =
        deepest != of_segments.end() && deepest->node == old.node && deepest->penetration >= -reach.touching;
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
bool test_only(const PointshellView& shell, const Field& field, const Pose& pose, SegmentReach reach,
               std::span<const SegmentPoint> before, std::span<Contact> contacts) {
  const Transform to_field(pose);
  for (std::size_t i = 0; i < before.size(); ++i) {
    contacts[i] = contact_at(shell, field, to_field, before[i]);
    if (!(contacts[i].penetration >= -reach.contact)) return false;
  }
  sort_by_segments(contacts.first(before.size()));
  return true;
}

// What every partner's query needs.
struct FieldQuery {
  const StepPair& pair;
  const Partner& partner;
  QueryOptions options;  // with the margins and the cache
  PairMemory& memory;
  Workspace& space;
  std::span<Contact> contacts;  // room for as many as the shell has points
  bool chooses = false;         // a few of many
};

// Whether the points in contact need nothing but their depth before some are chosen. Those of bodies without faces have
// none, and those with round bodies are seeds of others.
bool has_hits_only(const Partner& partner) {
  if (partner.convex != nullptr) return partner.convex->has_faces();
  return !round_of(partner.field);
}

// Gives hits the V of the body where its planes only bound it, and removes those that are no contacts.
void keep_hits(const FieldQuery& query, ContactRows& hits) {
  const Partner& partner = query.partner;
  if (partner.convex == nullptr && partner.tops == nullptr) return;
  std::uint32_t kept = 0;
  for (std::uint32_t i = 0; i < hits.count; ++i) {
    const Vec3 place{hits.position[0][i], hits.position[1][i], hits.position[2][i]};
    if (partner.tops != nullptr && !partner.has_ground(place)) continue;
    const float v =
        partner.convex != nullptr ? partner.convex->penetration(place, hits.penetration[i]) : hits.penetration[i];
    if (!(v >= -query.options.contact_distance)) continue;
    for (float* const row : hits.position) row[kept] = row[i];
    hits.feature[kept] = hits.feature[i];
    hits.penetration[kept++] = v;
  }
  hits.count = kept;
}

constexpr float kAlike = 1.001F;  // the way of a step is never quite the same

// Whether the contacts of segments hold: the pair stands still. No others are sought then, unless one has left.
bool segments_hold(const FieldQuery& query) {
  const ChoiceMemory& choice = query.memory.choice;
  return query.options.contact_distance <= kAlike * choice.reach && stands_still(query.pair, choice.stand);
}
// Whether a choice of contacts holds, also that of a body that slides along a plane.
bool choice_holds(const FieldQuery& query) {
  const ChoiceMemory& choice = query.memory.choice;
  return query.options.contact_distance <= kAlike * choice.reach &&
         stands_still(query.pair, query.memory.face, choice.stand);
}
std::span<const ContactPlace> chosen_before(const FieldQuery& query) {
  const ChoiceMemory& choice = query.memory.choice;
  const bool is_known = query.chooses && choice.count > 0 && choice_holds(query);
  return is_known ? choice.chosen() : std::span<const ContactPlace>();
}

// Finds points in contact.
Status find_rows(const FieldQuery& query, FoundContacts& found) {
  const PointshellView& shell = query.pair.shell;
  const Pose& pose = query.pair.shell_to_field;
  Scratch& scratch = query.space.scratch;
  if (query.chooses && query.memory.choice.none && choice_holds(query)) {
    found.are_known = true;
    return Status::ok;
  }
  if (const std::span<const ContactPlace> known = chosen_before(query); !known.empty()) {
    std::array<std::uint32_t, 4> points{};
    std::transform(known.begin(), known.end(), points.begin(), [](const ContactPlace& place) { return place.feature; });
    const Status status = find_hits_of({points.data(), known.size()}, shell, query.partner.field, pose, query.options,
                                       scratch, found.hits);
    keep_hits(query, found.hits);
    found.are_known = found.hits.count == known.size();
    if (status != Status::ok || found.are_known) return status;
  }
  const Status status = find_hits(shell, query.partner.field, pose, query.options, scratch, found.hits, found.most);
  keep_hits(query, found.hits);
  return status;
}

// As FoundContacts::most.
float most_of(FieldRef field, const QueryResult& result) {
  const VoxelmapView* const map = field.voxelmap();
  const auto bound = static_cast<float>(result.delta_bound);
  if (map == nullptr) return bound;
  return map->field == Field::scaled ? bound + field_error(*map) : std::numeric_limits<float>::max();
}

template <class Field>
Status find_in_field(const FieldQuery& query, const Field& field, FoundContacts& found) {
  const StepPair& pair = query.pair;
  const PointshellView& shell = pair.shell;
  const Pose& pose = pair.shell_to_field;
  QueryOptions options = query.options;
  // Planes of a body without faces change from query to query.
  if (query.partner.convex != nullptr && !query.partner.convex->has_faces()) options.cache = nullptr;
  const std::span<Contact> contacts = query.contacts;
  const SegmentReach reach{options.contact_distance, pair.margin + kTouching_vx * static_cast<float>(pair.voxel_size)};
  const std::span<const SegmentPoint> segments = query.memory.segments.points;
  if (!segments.empty() && segments_hold(query) && test_only(shell, field, pose, reach, segments, contacts)) {
    found.contacts = {contacts.data(), segments.size()};
    found.are_known = true;
    return Status::ok;
  }
  query.memory.choice = {pair.shell_to_field, query.options.contact_distance, {}};
  QueryResult result;
  const Status status = [&] {
    if (!(found.way > 0)) return traverse_contacts(shell, field, pose, options, query.space.scratch, contacts, result);
    options.contact_distance -= found.way;
    // The ways of bodies that move together may have any direction.
    const RelativeMotion motion =
        found.is_joint ? RelativeMotion{{found.way, 0, 0}, {}, false} : motion_of(pair, found);
    return traverse_ahead(shell, field, pose, options, motion, query.space.scratch, contacts, result);
  }();
  if (status != Status::ok) return status;
  found.most = most_of(field, result);
  const std::size_t count = test_again(shell, field, pose, reach, segments, contacts, result.contacts);
  found.contacts = {contacts.data(), count};
  return status;
}

Status find_on_sheet(const FieldQuery& query, FoundContacts& found) {
  SheetContacts& on_sheet = query.space.on_sheet;
  const Status status = query.partner.sheet->find(query.options, chosen_before(query), on_sheet);
  found.are_known = on_sheet.are_known;
  found.contacts = on_sheet.contacts;
  found.features = on_sheet.features;
  found.in_shell_frame = true;
  found.refined = FoundContacts::Refined::all;
  return status;
}

// Replaces points of the shell that touch a sphere or capsule by places on the shell's own distance field.
void use_distances(const FieldQuery& query, const Round& round, FoundContacts& found) {
  const StepPair& pair = query.pair;
  if (!takes_round(pair.distances, round.radius)) return;
  const Transform to_map = pair.to_shell();
  std::vector<Contact>& seeds = query.space.seeds;
  seeds.assign(found.contacts.begin(), found.contacts.end());
  for (Contact& seed : seeds) {
    seed.position = to_map.apply(seed.position);
    seed.inward_normal = to_map.rotate(seed.inward_normal);
  }
  const RoundInMap in_map{to_map.apply({0, 0, 0}), to_map.rotate(round.half_axis), round.radius};
  std::vector<Contact>& contacts = query.space.on_map;
  if (!find_round_contacts(pair.distances, in_map, seeds, query.options.contact_distance, found.shell_points,
                           contacts)) {
    return;
  }
  found.has_map_contacts = true;
  found.contacts = contacts;
  found.in_shell_frame = true;
  found.refined = FoundContacts::Refined::all;
}

// Whether a corner lies near the sphere around the shell.
bool is_any_near(const Corners& corners, const StepPair& pair, float reach) {
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  const float of_shell = sphere_radius(pair.shell, 0) + reach;
  for (std::size_t i = 0; i < corners.places.size(); ++i) {
    const Vec3 away = corners.places[i] - centre;
    const float farthest = of_shell + corners.rounding(i) + pair.touching();
    if (dot(away, away) <= farthest * farthest) return true;
  }
  return false;
}

// Corners may lie between the points of the shell.
void add_corners(const FieldQuery& query, FoundContacts& found) {
  const StepPair& pair = query.pair;
  std::vector<Contact>& contacts = query.space.on_map;
  contacts.clear();
  if (pair.distances.field == Field::none ||
      !is_any_near(query.partner.corners, pair, query.options.contact_distance) ||
      !add_corner_contacts(pair.distances, pair.shell, pair.to_shell(), query.partner.corners,
                           query.options.contact_distance, contacts)) {
    return;
  }
  found.has_map_contacts = true;
  const float least = least_beside(contacts, pair.touching());
  if (least > -std::numeric_limits<float>::infinity()) keep_deeper(least, found.hits);
  std::copy_if(found.contacts.begin(), found.contacts.end(), std::back_inserter(contacts),
               [&](const Contact& contact) { return contact.penetration > least; });
  found.contacts = contacts;
}

// The contacts of a solid on flat baked ground. @return whether the ground is flat there
bool find_on_plane(const FieldQuery& query, FoundContacts& found) {
  std::vector<Contact>& contacts = query.space.on_map;
  contacts.clear();
  const std::optional<float> most =
      add_contacts_on_plane(query.pair, query.partner, query.options.contact_distance, query.memory, contacts);
  if (!most) return false;
  query.memory.choice = {};
  found.most = *most;
  found.has_map_contacts = true;
  found.contacts = contacts;
  return true;
}

Status find_in_solid(const FieldQuery& query, FoundContacts& found) {
  const StepPair& pair = query.pair;
  const Partner& partner = query.partner;
  // Springs act on the areas of points.
  const bool needs_points = pair.segment_level > 0 || pair.has_springs();
  // A plane that is proven for one query costs more than it saves.
  const bool takes_plane = query.memory.is_lasting && (query.memory.last_count > 0 || pair.shell_motion != nullptr) &&
                           pair.use == StepUse::constraints && pair.segment_level == 0 && !found.is_joint;
  if (takes_plane && partner.map() == nullptr && find_on_plane(query, found)) return Status::ok;
  const bool has_hits = query.chooses && has_hits_only(partner);
  const Status status =
      has_hits ? find_rows(query, found)
               : partner.field.visit([&](const auto& field) { return find_in_field(query, field, found); });
  if (status != Status::ok || partner.map() != nullptr) return status;
  if (partner.tops != nullptr) {
    const auto is_over_hole = [&](const Contact& contact) { return !partner.has_ground(contact.position); };
    const auto last = std::remove_if(found.contacts.begin(), found.contacts.end(), is_over_hole);
    found.contacts = {found.contacts.begin(), last};
    return status;
  }
  if (partner.convex != nullptr && !has_hits) {
    finish_convex(pair, partner, query.options.contact_distance, found);
  }
  if (needs_points) return status;
  if (const std::optional<Round> round = round_of(partner.field); round) {
    use_distances(query, *round, found);
  } else {
    add_corners(query, found);
  }
  return status;
}

}  // namespace

Status find_contacts(const StepPair& pair, const Partner& partner, QueryOptions options, PairMemory& memory,
                     Workspace& space, FoundContacts& found) {
  options.contact_distance += pair.margin;
  if (memory.is_lasting) options.cache = &memory.cache;
  memory.segments.belong_to(pair.shell, options.segment_level);
  const bool chooses = options.segment_level == 0 && !pair.has_springs();
  found.shell_points = pair.shell.points;
  const std::span<Contact> room = space.contacts.grow(pair.shell.points);
  const FieldQuery query{pair, partner, options, memory, space, room, chooses};
  const Status status = [&] {
    if (partner.sheet != nullptr) return find_on_sheet(query, found);
    if (partner.map() == nullptr || !(found.way > 0)) return find_in_solid(query, found);
    // Where a point arrives is found later: farther out a bound of its distance is enough.
    VoxelmapView map = *partner.map();
    map.far.range = std::numeric_limits<float>::max();
    return find_in_solid({pair, Partner{map}, options, memory, space, room, chooses}, found);
  }();
  if (status != Status::ok) return status;
  if (pair.margin > 0) {
    for (Contact& contact : found.contacts) contact.penetration += pair.margin;
    for (std::uint32_t i = 0; i < found.hits.count; ++i) found.hits.penetration[i] += pair.margin;
  }
  return status;
}

float bound_farther(const StepPair& pair, const Partner& partner, float distance, Workspace& space) {
  QueryOptions options;
  options.contact_distance = distance;
  options.max_tests = 512;  // some 5 us: a body that lands must not wait for it
  QueryResult result;
  const Status status =
      traverse_contacts(pair.shell, partner.field, pair.shell_to_field, options, space.scratch, {}, result);
  const bool is_answer = status == Status::ok || status == Status::output_full;
  return is_answer ? most_of(partner.field, result) : std::numeric_limits<float>::max();
}

void remember_choice(const StepPair& pair, const FoundContacts& found, std::span<const std::uint32_t> rows,
                     PairMemory& memory) {
  if (found.are_known) return;
  ChoiceMemory& choice = memory.choice;
  choice.count = 0;
  choice.none = rows.empty();
  choice.reach = found.reach + pair.margin;
  choice.stand = pair.shell_to_field;
  if (rows.size() > choice.places.size()) return;
  for (const std::uint32_t row : rows) {
    if (row < found.hits.count) {
      choice.places[choice.count++] = {0, found.hits.feature[row]};
    } else if (!found.features.empty()) {
      choice.places[choice.count++] = {found.contacts[row].node, found.features[row]};
    }
  }
  const std::array<ContactPlace, 4> chosen = choice.places;
  const auto last = choice.places.begin() + choice.count;
  std::sort(choice.places.begin(), last);
  for (std::size_t i = 0; i < choice.count; ++i) {
    choice.in_order[i] =
        static_cast<std::uint32_t>(std::find(choice.places.begin(), last, chosen[i]) - choice.places.begin());
  }
}

ContactRows rows_of(const FoundContacts& found, Workspace& space) {
  // Beside hits there are no contacts but those of corners.
  static_assert(kMostCorners <= kExtraRows);
  ContactRows rows = found.hits;
  if (rows.count == 0) {
    const std::size_t room = found.contacts.size() + kLanePadding;
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

void add_contacts_of_rows(const StepPair& pair, const FoundContacts& found, std::span<const std::uint32_t> rows,
                          std::vector<ManifoldContact>& contacts) {
  const Transform transform(pair.shell_to_field);
  for (const std::uint32_t row : rows) {
    if (row >= found.hits.count) {
      const std::size_t i = row - found.hits.count;
      contacts.push_back({found.contacts[i], feature_of(found.contacts, found.features, i)});
      continue;
    }
    const ContactRows& hits = found.hits;
    const std::uint32_t point = hits.feature[row];
    const Vec3 position{hits.position[0][row], hits.position[1][row], hits.position[2][row]};
    contacts.push_back({{position, transform.rotate(point_inward_normal(pair.shell, point)), hits.penetration[row],
                         point_area(pair.shell, point), point, 0},
                        point});
  }
}

}  // namespace vps::detail
