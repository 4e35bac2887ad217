// SPDX-License-Identifier: Zlib
// From a pair to its contacts in a step. Paper: Secs. 2.4 and 3.2.
#include "runtime/contacts/side_contacts.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "runtime/contacts/baked_corners.h"
#include "runtime/contacts/refine_contacts.h"
#include "runtime/contacts/traverse/traverse_query.h"
#include "runtime/contacts/wide_face.h"
#include "runtime/fields/penetration.h"

namespace vps::detail {
namespace {

// A body that lands needs contacts wherever it may touch first. A level has some 12 times as many clusters as the one
// above it, so there are 23 segments at least, and 280 at most: with 19 a wheel at 5 m/s and 60 Hz hops and turns
// aside.
constexpr std::uint32_t kLandingSegments = 80;
constexpr std::uint32_t kJointSegments = 64;  // at least

// The level of a landing pair's segments. Where the partner is smaller than the shell, so are the segments: on a single
// one it would tip.
std::uint32_t landing_level(const PointshellView& shell, float radius) {
  if (shell.points == 0) return 0;
  const double ratio = double(sphere_radius(shell, 0)) / std::max(double{radius}, 1e-9);
  const double wanted = kLandingSegments * std::max(1.0, ratio * ratio);
  return segment_level_for(shell, static_cast<std::uint32_t>(std::min<double>(wanted, shell.points)));
}

// Bodies that move together need many contacts: one of them may be stopped at any place. @return 1 is the root
std::uint32_t joint_level(const PointshellView& shell) {
  std::uint32_t level = 1;
  while (level < shell.levels && shell.level_offsets[level] - shell.level_offsets[level - 1] < kJointSegments) ++level;
  return level;
}

// Motion in a step that ends the rest of a pair. [vx]
constexpr double kCarried_vx = 0.05;
// A body of a stack that settles moves less than this, one that slides more. [vx]
constexpr double kSlides_vx = 0.5;
constexpr float kOneFace = 1 - 5e-7F;  // cosine between normals: a thousandth of a radian

// Steps that a pair keeps its contacts of segments after its last long fall, for those whose steps differ in length.
// Four contacts in the short steps and many in the long ones shake stacks until they fall.
constexpr std::uint8_t kAfterLongFall = 60;

bool falls_far(const StepPair& pair, PairMemory& memory) {
  if (pair.shell_motion == nullptr || pair.field_motion == nullptr) return false;
  const float longest = kLongFall_vx * static_cast<float>(pair.voxel_size);
  const auto is_long = [=](Vec3 fall) { return dot(fall, fall) > longest * longest; };
  if (is_long(pair.shell_motion->fall) || is_long(pair.field_motion->fall)) {
    memory.falls_far = kAfterLongFall;
  } else if (memory.falls_far > 0) {
    --memory.falls_far;
  }
  return memory.falls_far > 0;
}

// What stood along another face may have come closer to this one.
void keep_face(const StepPair& pair, const Partner& partner, PairMemory& memory) {
  const std::optional<Vec3> face = wide_face(pair, partner);
  if (face.has_value() == memory.face.has_value() && (!face || dot(*face, *memory.face) > kOneFace)) return;
  memory.face = face;
  memory.now = memory.choice.stand = memory.slides.stand = {};
}

// @param face  outward normal, field's frame
bool shell_moves_along(const StepPair& pair, Vec3 face) {
  return moves_along(*pair.shell_motion, *pair.field_motion, Transform(pair.field_pose).rotate(face), pair.voxel_size);
}

// Whether a body slides along a wide face.
bool slides_along(const StepPair& pair, const Partner& partner, float distance, PairMemory& memory) {
  const float fall = length(pair.shell_motion->fall - pair.field_motion->fall);
  if (fall > kLongFall_vx * static_cast<float>(pair.voxel_size)) return false;
  const std::optional<Vec3> face = memory.face ? memory.face : even_face(pair, partner, distance, memory.cache);
  return face && shell_moves_along(pair, *face);
}

// A pair that touches and has not moved, or only along a face, is carried. With a voxel smaller than the fall of a
// step, it would else get contacts ahead for ever. It is carried until it moves more: with few contacts and many in
// turn, stacks sway.
bool is_carried(const StepPair& pair, const Partner& partner, const SideQuery& query, PairMemory& memory) {
  const Approach& approach = query.approach;
  const bool slid = std::exchange(memory.slides_along, false);
  if (!memory.touched) return false;
  // The lowest body of a stack that creeps along the ground does not slide.
  const std::optional<Vec3> face = slid ? memory.face : std::nullopt;
  const auto stands = [&](double most) { return stands_still(pair, face, memory.now, most); };
  const bool is_slow = !(approach.way > 0) || (approach.phase == Approach::Phase::still && stands(kSlides_vx));
  if (is_slow && stands(memory.is_carried ? kCarried_vx : kStill_vx)) return true;
  // One that slid slides until it stops.
  if (is_slow && !(slid && approach.way > 0)) return false;
  // Four contacts suffice where segments have more.
  const bool has_many = memory.is_carried || memory.segments.points.size() > 4;
  memory.slides_along = has_many && !approach.is_joint &&
                        slides_along(pair, partner, query.distance + pair.margin + approach.way, memory);
  return memory.slides_along;
}

// What the functions below need.
struct Side {
  const StepPair& pair;
  const Partner& partner;
  const SideQuery& query;
  PairMemory& memory;
  Workspace& space;
};

// Whether a body stands on a plane over tops, on places that are wide apart. In a hole or on an edge it meets the map.
bool stands_on(const StepPair& pair, const Partner& partner, const HalfSpaceField& plane, Workspace& space) {
  constexpr float kDeep_vx = 0.5F;
  constexpr std::uint32_t kMostTested = 64;
  const auto voxel = static_cast<float>(pair.voxel_size);
  QueryOptions options;
  options.contact_distance = pair.margin + pair.touching();
  ContactRows hits;
  float most = 0;
  if (find_hits(pair.shell, plane, pair.shell_to_field, options, space.scratch, hits, most) != Status::ok) return false;
  const std::uint32_t step = hits.count / kMostTested + 1;
  Footing footing(pair, *partner.tops, plane);
  std::uint32_t grounded = 0;
  Vec3 first;
  float widest = 0;
  for (std::uint32_t i = 0; i < hits.count; ++i) {
    if (hits.penetration[i] + pair.margin > kDeep_vx * voxel) return false;
    if (i % step != 0) continue;
    const Vec3 place{hits.position[0][i], hits.position[1][i], hits.position[2][i]};
    if (!footing.test(place, place)) continue;
    if (grounded++ == 0) first = place;
    widest = std::max(widest, length(place - first));
  }
  return footing.holds() && grounded >= 3 && widest >= sphere_radius(pair.shell, 0);
}

// The plane over tops, as a partner.
std::optional<Partner> tops_below(const StepPair& pair, const Partner& whole, float distance, PairMemory& memory,
                                  Workspace& space) {
  const VoxelmapView* const map = whole.map();
  if (map == nullptr || pair.shell.points == 0) return {};
  const Stand before = std::exchange(memory.tops.stand, {});
  if (!memory.is_lasting || !memory.touched || !memory.lay_flat() || pair.shell_motion == nullptr) return {};
  const bool is_known = stands_still(pair, before);
  memory.tops.stand = is_known ? before : pair.shell_to_field;
  if (is_known && !memory.tops.are_met) return {};
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(pair.shell, 0));
  const float reach = kStretch * sphere_radius(pair.shell, 0) + distance;
  const HalfSpaceField* const plane = tops_around(*map, centre, reach, memory.ground);
  if (plane == nullptr || !shell_moves_along(pair, plane->outward_normal)) return {};
  Partner tops{*plane, nullptr, nullptr, {}, whole.radius};
  tops.tops = map;
  return is_known || stands_on(pair, tops, *plane, space) ? std::optional(tops) : std::nullopt;
}

// The other body, if its corners are sought in the shell's; or null. A body that is flat all around has none there, and
// of a thinned shell's partner all points are sought.
const VoxelmapView* map_with_corners(const Side& side) {
  const VoxelmapView* const map = side.partner.map();
  const bool seeks = map != nullptr && map->corners > 0 && !side.pair.has_springs() && !side.query.leaves_faces &&
                     side.pair.distances.field != Field::none;
  return seeks ? map : nullptr;
}

// Remembers how far apart a pair without contacts is. A query may only have proven that the bodies do not touch, and
// the pair would be asked in each step. So a pair that stays near is looked at again, some steps of its motion farther.
// @param before  where it was in the last step; none if it touched then
void remember_gap(const Side& side, const FoundContacts& found, const Stand& before) {
  constexpr float kSteps = 5;
  const StepPair& pair = side.pair;
  GapMemory& gap = side.memory.gap;
  float most = found.most;
  const float ahead = std::max(static_cast<float>(pair.voxel_size), kSteps * found.way);
  const float farther = found.reach + pair.margin + ahead;
  // Bodies that are faster do not stay near.
  const auto moved = [&](const Stand& since) { return motion_between(pair.shell, since, pair.shell_to_field); };
  const bool stays = ahead < 0.5F * sphere_radius(pair.shell, 0) && moved(before) < 0.25 * double{ahead};
  if (stays && most > -farther && moved(gap.sought) > 0.5 * double{ahead}) {
    gap.sought = pair.shell_to_field;
    most = std::min(most, bound_farther(pair, side.partner, farther, side.space));
  }
  // Round bodies and Bullet's corners also meet the surface between the points, which is within the covering radius of
  // one.
  const float between = side.partner.map() == nullptr ? pair.shell.covering_radius : 0;
  if (const VoxelmapView* map = map_with_corners(side)) most = std::max(most, most_of_corners(pair, *map, most));
  const double distance = -double{most} - double{between};
  if (!(distance > 0)) return;
  gap.stand = pair.shell_to_field;
  gap.distance = distance;
}

ManifoldContact with_feature(const FoundContacts& found, std::size_t i) {
  return {found.contacts[i], feature_of(found.contacts, found.features, i)};
}

// Few contacts of many.
void choose(const Side& side, const FoundContacts& found) {
  const StepPair& pair = side.pair;
  std::vector<ManifoldContact>& few = side.space.few;
  const ContactRows rows = rows_of(found, side.space);
  const ChoiceMemory& choice = side.memory.choice;
  const bool is_chosen = found.are_known && rows.count == choice.count;
  std::array<std::uint32_t, 4> four = choice.in_order;
  std::size_t count = is_chosen ? choice.count : choose_four(rows, side.memory.last_features(), pair.alike(), four);
  if (is_chosen && count > 0) {
    // Those that were chosen stay so, and the deepest comes first. In the order of their numbers neighbours follow each
    // other, and bodies creep down slopes; in the order of the choice alone they tremble.
    const auto deepest = std::max_element(four.begin(), four.begin() + count, [&](std::uint32_t i, std::uint32_t k) {
      return rows.penetration[i] < rows.penetration[k];
    });
    std::swap(four[0], *deepest);
  }
  const std::size_t most = found.way > 0 ? side.query.most_ahead : side.query.most;
  count = std::min(count, most);
  std::vector<std::uint32_t>& chosen = side.space.chosen;
  chosen.assign(four.begin(), four.begin() + count);
  if (most > four.size()) {
    const auto squared = [&](std::size_t i, std::size_t k) {
      const auto along = [&](int axis) { return rows.position[axis][i] - rows.position[axis][k]; };
      return along(0) * along(0) + along(1) * along(1) + along(2) * along(2);
    };
    choose_more(
        rows.count, [&](std::size_t i) { return rows.penetration[i]; }, squared, pair.alike(), most, side.space.nearest,
        chosen);
  }
  remember_choice(pair, found, chosen, side.memory);
  add_contacts_of_rows(pair, found, chosen, few);
  if (are_refined(pair, side.partner, found, side.memory, few)) return;
  few.resize(refine(pair, side.partner, found, few));
  for (std::size_t i = 0; i < few.size(); ++i) few[i].slot = static_cast<int>(i / side.query.most);
}

// Few springs that have the wrench of all penetrating points.
Status reduce(const Side& side, const FoundContacts& found) {
  const StepPair& pair = side.pair;
  std::vector<ManifoldContact>& pressing = side.space.all;
  std::vector<Contact>& all = side.space.seeds;
  std::vector<Contact>& reduced = side.space.on_map;
  pressing.clear();
  for (std::size_t i = 0; i < found.contacts.size(); ++i) {
    if (found.contacts[i].penetration >= 0) pressing.push_back(with_feature(found, i));
  }
  pressing.resize(refine(pair, side.partner, found, pressing));
  // The reduction ignores features but keeps `point`: it holds the contact's index in `pressing` here.
  all.assign(pressing.begin(), pressing.end());
  for (std::size_t i = 0; i < all.size(); ++i) all[i].point = static_cast<std::uint32_t>(i);
  reduced.resize(side.query.most);
  const float* const c = pair.shell.centre_of_mass;
  const Vec3 centre{c[0], c[1], c[2]};
  const Vec3 about = found.in_shell_frame ? centre : Transform(pair.shell_to_field).apply(centre);
  Reduction reduction;
  const Status status = reduce_contacts(all, about, reduced, side.space.reduction, reduction);
  if (status != Status::ok) return status;
  for (std::size_t i = 0; i < reduction.kept; ++i) {
    const ManifoldContact& source = pressing[reduced[i].point];
    side.space.few.push_back({reduced[i], source.feature});
    side.space.few.back().point = source.point;
  }
  return Status::ok;
}

// Sec. 2.4: up to three contacts for each segment. Each keeps its slot from step to step.
void keep_of_segments(const Side& side, std::uint32_t level, const FoundContacts& found) {
  const StepPair& pair = side.pair;
  const std::uint32_t base = pair.shell.level_offsets[level - 1];
  std::vector<ManifoldContact>& contacts = side.space.all;
  contacts.clear();
  for (std::size_t i = 0; i < found.contacts.size(); ++i) contacts.push_back(with_feature(found, i));
  contacts.resize(refine(pair, side.partner, found, contacts));
  for (const SegmentPoint& kept : keep_segments(contacts, pair.beside(), pair.alike(), side.memory.segments)) {
    side.space.few.push_back(*kept.at);
    side.space.few.back().slot = static_cast<int>(kept.node - base) * kContactsPerSegment + kept.place;
  }
}

// Adds the contacts of the other body's corners, in further slots.
// @param way  as FoundContacts::way
void add_corners(const Side& side, float way) {
  const StepPair& pair = side.pair;
  const VoxelmapView* const map = map_with_corners(side);
  if (map == nullptr) return;
  std::vector<ManifoldContact>& few = side.space.few;
  const std::size_t of_points = few.size();
  const int slot = few.empty() ? 0 : few.back().slot + 1;
  const CornersQuery query{side.query.distance + pair.margin, least_beside(few, pair.touching()), way,
                           side.query.approach.is_joint, side.query.most};
  add_contacts_of_corners(pair, *map, query, side.memory.corners, side.space, few);
  for (std::size_t i = of_points; i < few.size(); ++i) {
    few[i].slot = slot + static_cast<int>((i - of_points) / side.query.most);
    side.memory.touched = side.memory.touched || few[i].penetration >= -pair.touching();
  }
}

}  // namespace

double distance_to_box(const StepPair& pair, const FieldBox& box) noexcept {
  constexpr double kFarthest = 1e6;  // the query checks the poses of bodies that are farther from each other. [m]
  const PointshellView& shell = pair.shell;
  if (shell.points == 0) return 0;
  const Vec3 centre = Transform(pair.shell_to_field).apply(sphere_centre(shell, 0));
  const auto outside = [](float at, float low, float high) { return std::max({low - at, at - high, 0.0F}); };
  const Vec3 off{outside(centre.x, box.low.x, box.high.x), outside(centre.y, box.low.y, box.high.y),
                 outside(centre.z, box.low.z, box.high.z)};
  const double distance = double{length(off)};
  // The covering radius is for the surface between the points.
  const double taken = double{kStretch} * double{sphere_radius(shell, 0)} + double{shell.covering_radius};
  return distance < kFarthest ? distance - taken : 0;
}

Status contacts_of_side(const StepPair& pair, const Partner& whole, const SideQuery& query, PairMemory& memory,
                        Workspace& space, SideContacts& out) {
  const Approach& approach = query.approach;
  const bool needs_many = falls_far(pair, memory);
  // Flat baked ground is a plane. Springs would jump at its end, and who asks for segments wants those of samples.
  const bool takes_plane = !approach.is_joint && !pair.has_springs() && pair.segment_level == 0;
  const float farthest = query.distance + pair.margin + approach.way;
  const HalfSpaceField* const ground = takes_plane ? flat_ground(pair, whole, farthest, memory.ground) : nullptr;
  // Over slots a flat part's edges meet those of the ground, and no direction between their faces is that of a contact.
  const std::optional<Partner> tops = takes_plane && pair.use == StepUse::constraints && ground == nullptr
                                          ? tops_below(pair, whole, farthest, memory, space)
                                          : std::nullopt;
  const Partner partner = tops                ? *tops
                          : ground != nullptr ? Partner{*ground, nullptr, nullptr, {}, whole.radius}
                                              : whole;
  if (std::exchange(memory.tops.are_met, tops.has_value()) != tops.has_value()) {
    memory.choice = {};
    memory.slides.stand = {};
    memory.segments.points.clear();
  }
  keep_face(pair, partner, memory);
  memory.is_carried = !needs_many && is_carried(pair, partner, query, memory);
  const float way = memory.is_carried ? 0 : approach.way;
  const Stand before = memory.touched ? Stand() : memory.now;
  memory.now = pair.shell_to_field;
  memory.touched = false;
  QueryOptions options;
  options.contact_distance = query.distance + way;
  options.segment_level = pair.segment_level;
  options.leaves_faces = query.leaves_faces && !tops;
  // With a margin contacts press before they are inside.
  if (pair.has_springs() && !(pair.margin > 0)) options.flat_patches = query.flat_patches;
  if (way > 0 || needs_many) {
    // With more than one contact for each segment, the solver's iterations do not suffice to stop a landing body.
    if (approach.phase == Approach::Phase::landing) memory.segments.points.clear();
    if (options.segment_level == 0 && !pair.has_springs()) {
      options.segment_level = approach.is_joint ? joint_level(pair.shell) : landing_level(pair.shell, partner.radius);
    }
  }
  FoundContacts found;
  found.reach = options.contact_distance;
  found.way = way;
  found.is_joint = approach.is_joint;
  if (const Status status = find_contacts(pair, partner, options, memory, space, found); status != Status::ok) {
    return status;
  }
  if (way > 0) keep_arriving(pair, partner, found);
  // A pair that stands still is known to have no contacts from its second step on: it seeks its gap once.
  const bool seeks_gap = ground == nullptr && !tops && !(found.are_known && memory.gap.sought) &&
                         partner.sheet == nullptr && memory.is_lasting;
  if (seeks_gap && found.hits.count == 0 && found.contacts.empty()) {
    remember_gap({pair, partner, query, memory, space}, found, before);
  }
  const float touching = pair.touching();
  memory.touched = found.hits.count > 0 || std::any_of(found.contacts.begin(), found.contacts.end(),
                                                       [=](const Contact& c) { return c.penetration >= -touching; });
  std::vector<ManifoldContact>& few = space.few;
  few.clear();
  const Side side{pair, partner, query, memory, space};
  const bool has_segments = options.segment_level > 0 && !found.has_map_contacts;
  if (!has_segments) memory.segments.points.clear();
  if (has_segments) {
    keep_of_segments(side, options.segment_level, found);
  } else if (pair.has_springs()) {
    if (const Status status = reduce(side, found); status != Status::ok) return status;
  } else {
    choose(side, found);
  }
  // Who asks for samples or segments gets them: their normals carry a nut down its thread, and one slid over a field
  // does not.
  if (pair.use == StepUse::constraints && pair.segment_level == 0 && !tops) {
    few.resize(move_between_samples(pair, partner, found, memory, space, few));
  }
  add_corners(side, way);
  memory.remember(few);
  out = {few, found.in_shell_frame, found.reach, tops.has_value()};
  return Status::ok;
}

}  // namespace vps::detail
