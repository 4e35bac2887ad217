// SPDX-License-Identifier: Zlib
/// @file The contacts of a pair, for every kind of partner. Internal. Paper: Secs. 2.3 and 2.4.
#pragma once

#include <array>
#include <limits>

#include "runtime/bullet/manifold_contact.h"
#include "runtime/bullet/pair.h"
#include "runtime/bullet/partners/convex_planes.h"
#include "runtime/bullet/partners/triangle_contacts.h"
#include "runtime/bullet/segment_contacts.h"
#include "runtime/contacts/between_samples.h"
#include "runtime/contacts/find_hits.h"
#include "runtime/fields/place_field.h"

namespace vps::bullet {

/// Where contacts slid to. A pair that stands still need not search again.
struct SlideMemory {
  Stand stand;
  std::uint64_t mesh = 0;  ///< hash of the triangles near the shell
  std::vector<detail::Slid> slid;
};

/// The contacts that were chosen for the manifold. While the pair stands still, no others are sought: a face touches
/// with thousands of points. Those of segments are in SegmentMemory.
struct ChoiceMemory {
  Stand stand;      ///< where the pair stood when all were sought
  float reach = 0;  ///< contact distance of that query. [m]
  std::array<ContactPlace, MANIFOLD_CACHE_SIZE> places{};
  std::size_t count = 0;
  [[nodiscard]] std::span<const ContactPlace> chosen() const { return {places.data(), count}; }
};

/// A proven distance between the bodies. As long as they have not moved that far, no contacts are sought.
struct GapMemory {
  Stand stand;
  double distance = 0;  ///< without margins; at most 0: none. [m]
};

/// What a pair remembers from step to step.
struct PairMemory {
  ContactCache cache;
  SegmentMemory segments;
  ConvexPlanes planes;
  TriangleMemory triangles;
  SlideMemory slides;
  ChoiceMemory choice;
  GapMemory gap;
  Stand now;                ///< in this step
  bool touched = false;     ///< in the last one
  bool is_carried = false;  ///< it rests, without contacts ahead
};

/// Working memory of a thread: pairs may run in parallel, assets are immutable.
struct Workspace {
  Scratch scratch;
  std::vector<float> rows[4];  // x, y, z, penetration
  std::vector<std::uint32_t> features;
  std::vector<Contact> contacts;
  TriangleContacts triangles;
  std::vector<Contact> on_map, seeds;
  static Workspace& of_this_thread(const PointshellView& shell);
};

struct FoundContacts {
  /// Points of the shell that are not among `contacts`: few of them are chosen later.
  detail::ContactRows hits;
  Pose shell_to_frame;     ///< takes the shell to the contacts' frame; only with hits
  bool are_known = false;  ///< those of ChoiceMemory or SegmentMemory, and no others were sought

  /// In tree order. Until `refine`, their `inward_normal` and area are the shell's.
  std::span<Contact> contacts;
  std::span<const std::uint32_t> features;  ///< see feature_of
  std::span<const Triangle> triangles;      ///< of a triangle mesh near the shell, contacts' frame
  btTransform frame;                        ///< takes the contacts' frame to the world
  /// The step in which contacts ahead may be met. Those that do not arrive are removed later. [s]
  btScalar step = 0;
  float way = 0;                  ///< of any point in the step; 0: contacts ahead are not sought. [m]
  bool is_joint = false;          ///< see Approach
  detail::RelativeMotion motion;  ///< of the step, contacts' frame; only with contacts ahead
  float reach = 0;                ///< largest distance of a contact off the surface. [m]
  /// Upper bound of the true V of the shell's points in the other body, without margins. [m]
  float most = std::numeric_limits<float>::max();

  /// Which of them have their final direction, penetration and area. `refine` leaves these as they are.
  enum class Refined : std::uint8_t {
    none,
    arriving,  ///< those farther off the surface than `arriving_beyond`
    all,
  };
  Refined refined = Refined::none;
  float arriving_beyond = std::numeric_limits<float>::infinity();  ///< [m]
  float turn = 0;  ///< of the bodies relative to each other, in a step with contacts ahead. [rad]
  /// Whether contacts other than the deepest may leave the shell's samples. Those of a body that falls stay spread out:
  /// they stop it in time.
  bool may_slide = true;
  /// Some are places in the shell's distance field (see is_on_map): a sphere's, or corners. There are no segments then.
  bool has_map_contacts = false;
  std::uint32_t shell_points = 0;

  /// Whether a contact is a place of the partner in the distance field of the shell's body. It is final.
  [[nodiscard]] bool is_on_map(const Contact& contact) const {
    return has_map_contacts && contact.point >= shell_points;
  }

  /// Whether a contact is speculative: it meets the partner later in the step.
  [[nodiscard]] bool is_ahead(const Contact& contact) const { return contact.penetration < -arriving_beyond; }
  /// Whether bodies that move together meet there only if one of them is stopped.
  [[nodiscard]] bool is_met_alone(const Contact& contact) const {
    if (!is_joint || !is_ahead(contact)) return false;
    const Vec3 moved = detail::operator+(motion.shift, detail::cross(motion.turn, contact.position));
    return -contact.penetration > arriving_beyond - detail::dot(contact.inward_normal, moved);
  }
  [[nodiscard]] bool is_refined(const Contact& contact) const {
    return refined == Refined::all || is_on_map(contact) || (refined == Refined::arriving && is_ahead(contact));
  }
};

/// Finds the contacts of a pair. With segments, it tests the points in contact in the last step again, except on
/// triangle meshes: a node may then have more than one contact.
/// @param options  of the query; this function sets the cache and adds the margins
/// @param found    has hits unless the contacts are of segments or springs, or of a round body
Status find_contacts(const Pair& pair, QueryOptions options, PairMemory& memory, FoundContacts& found);

/// Remembers the hits and the contacts with triangles among the rows that were chosen.
void remember_choice(const FoundContacts& found, std::span<const std::uint32_t> rows, PairMemory& memory);

/// Rows for the choice of a few: of the hits, then of `contacts`. Valid until the thread's next query.
detail::ContactRows rows_of(const PointshellView& shell, const FoundContacts& found);
/// The contact of one of these rows.
ManifoldContact contact_of_row(const PointshellView& shell, const FoundContacts& found, std::uint32_t row);

}  // namespace vps::bullet
