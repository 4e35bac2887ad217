// SPDX-License-Identifier: Zlib
/// @file A pair in a step as every engine describes it: one body's points in the other body. Internal. Paper: Sec. 3.2.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "runtime/contacts/between_samples.h"
#include "runtime/contacts/corner_contacts.h"
#include "runtime/contacts/segment_contacts.h"
#include "runtime/fields/place_field.h"
#include "runtime/grow.h"
#include "runtime/vps_contacts.h"

namespace vps::detail {

/// Points up to this far off the surface touch, so that a resting contact survives the noise of a step. With a whole
/// voxel, a bunny of default points on a box tests five times as many, and its flickering manifold never comes to
/// rest. [m]
/// @param voxel_size  the smaller one of a pair. [m]
inline float touching_distance(double voxel_size) noexcept {
  return static_cast<float>(0.1 * voxel_size);
}

/// How far a place of the surface is from a point at most, where it is on no face. [vx]
inline float spacing_vx(const PointshellView& shell, double voxel_size) noexcept {
  return shell.feature_covering_radius / static_cast<float>(voxel_size);
}

/// How far off the surface points are sought that may touch. Between points the surface rises above them with the
/// square of their spacing, by 0.1 voxels with default points on a bunny: what slides into contact from farther off
/// would come and go, and a body on coarse points would never rest. Points more than a voxel off do not slide. [m]
/// @param spacing_vx  of the body that gives the points
inline float contact_distance(double voxel_size, float spacing_vx) noexcept {
  constexpr float kDefault_vx = 1.5F;
  const float ratio = std::max(spacing_vx / kDefault_vx, 1.0F);
  return std::min(ratio * ratio * touching_distance(voxel_size), static_cast<float>(voxel_size));
}

/// The pair: where both bodies are and how they move.
struct StepPair {
  const PointshellView& shell;
  const VoxelmapView& distances;  ///< of the shell's body, scaled or real; Field::none: it has none
  Pose shell_pose, field_pose;    ///< of the frames of shell and field, to world
  double shell_voxel = 0;         ///< of the shell's body. [m]
  double voxel_size = 0;          ///< the smaller one of the two: the scale for distances between contacts. [m]
  float margin = 0;               ///< thickness of both bodies that the field does not include. [m]
  StepUse use = StepUse::constraints;
  std::uint32_t segment_level = 0;  ///< that the engine asks for; 0: none
  /// Both null: no contacts ahead are sought.
  const StepMotion *shell_motion = nullptr, *field_motion = nullptr;

  Pose shell_to_field = relative_pose(field_pose, shell_pose);
  [[nodiscard]] Transform to_shell() const noexcept { return Transform(relative_pose(shell_pose, field_pose)); }
  [[nodiscard]] float touching() const noexcept { return touching_distance(voxel_size); }
  /// Penetrations of a flat contact differ by the rounding of the samples: a fiftieth of a voxel. [m]
  [[nodiscard]] float alike() const noexcept { return static_cast<float>(0.02 * voxel_size); }
  /// Faces with penetrations that differ by less are equally deep: the spacing of the points resolves no more. [m]
  [[nodiscard]] float alike_faces() const noexcept { return static_cast<float>(0.5 * voxel_size); }
  /// Contacts closer together are the same one. [m]
  [[nodiscard]] float beside() const noexcept { return static_cast<float>(2 * voxel_size); }
  [[nodiscard]] bool has_springs() const noexcept { return use == StepUse::springs; }
};

/// A convex body whose field, planes, only bounds it.
class ConvexBody {
 public:
  virtual ~ConvexBody() = default;
  /// False: the planes change from query to query.
  [[nodiscard]] virtual bool has_faces() const = 0;
  /// V at a place. @param bound  V of the planes there. [m]
  [[nodiscard]] virtual float penetration(Vec3 place, float bound) const = 0;
  /// Sets penetration and direction of a contact.
  /// @param contact  field's frame; its inward_normal is the shell's on entry, and the direction on return
  /// @param alike    penetrations that differ by no more than this count as the same. [m]
  virtual void finish(Contact& contact, float alike) const = 0;
};

/// Where a contact was found.
struct ContactPlace {
  std::uint32_t leaf = 0;     ///< node; 0 where the feature suffices
  std::uint32_t feature = 0;  ///< see ManifoldContact
  bool operator==(const ContactPlace&) const = default;
  bool operator<(const ContactPlace& other) const {
    return leaf != other.leaf ? leaf < other.leaf : feature < other.feature;
  }
};

/// Contacts with a sheet: `features` in the order of `contacts`.
struct SheetContacts {
  std::vector<Contact> contacts;        ///< for a corner, `point` is a point of the shell near it
  std::vector<std::uint32_t> features;  ///< see ManifoldContact
  bool are_known = false;               ///< those that were known are among them, and only their leaves were searched
};

/// A body that is a sheet of triangles.
class Sheet {
 public:
  virtual ~Sheet() = default;
  /// @param options  contact_distance with the margins, and segment_level
  /// @param known    rising; may be empty
  /// @param found    final, in the shell's asset frame, in tree order
  virtual Status find(const QueryOptions& options, std::span<const ContactPlace> known, SheetContacts& found) = 0;
  /// Changes when the triangles near the shell do.
  [[nodiscard]] virtual std::uint64_t version() const = 0;
  /// Slides contacts over the triangles that the last `find` of this thread met.
  /// @param distances  of the shell's body, its asset frame
  virtual void slide(const PlacedField& distances, Slides& slides) const = 0;
};

/// The other body of a pair.
struct Partner {
  FieldRef field;                      ///< not used with a sheet
  const ConvexBody* convex = nullptr;  ///< null: the field is exact
  Sheet* sheet = nullptr;              ///< null: it is a solid
  Corners corners = {};                ///< that are looked up in the shell's body, field's frame
  float radius = 0;                    ///< of a sphere as large as its box; only for contacts ahead. [m]
  /// The field is the plane over the tops of this map. It counts where the map has a surface there, within 0.1
  /// voxels of the map. Null: it is whole.
  const VoxelmapView* tops = nullptr;
  Corners hull = {};  ///< all corners of a polyhedron, which meet planes; field's frame

  /// Whether there is a surface below a place.
  [[nodiscard]] bool has_ground(Vec3 place) const noexcept;
  [[nodiscard]] const VoxelmapView* map() const noexcept { return sheet == nullptr ? field.voxelmap() : nullptr; }
};

/// Sets the corners of a partner whose field is a box, or a cone, which has its tip. Others keep theirs.
/// @param room  where they are kept
void set_corners(std::array<Vec3, 8>& room, Partner& partner) noexcept;

/// A pose of the shell in the field's frame at which something held; none: it never did.
using Stand = std::optional<Pose>;

/// How far the points of the shell have moved at most. [m]
inline double motion_between(const PointshellView& shell, const Stand& before, const Pose& now) noexcept {
  return before ? largest_displacement(shell, *before, now) : std::numeric_limits<double>::infinity();
}

inline constexpr double kStill_vx = 0.01;

/// Whether a pair stands where it stood: no point of the shell has moved farther.
/// @param most  [vx of the shell]
inline bool stands_still(const StepPair& pair, const Stand& before, double most = kStill_vx) noexcept {
  return motion_between(pair.shell, before, pair.shell_to_field) <= most * pair.shell_voxel;
}
/// The same along the normal of a wide face. A body that slides along one comes no closer to it.
/// @param face  PairMemory::face; none: in any direction
inline bool stands_still(const StepPair& pair, const std::optional<Vec3>& face, const Stand& before,
                         double most = kStill_vx) noexcept {
  if (!face) return stands_still(pair, before, most);
  return before && largest_displacement(pair.shell, *before, pair.shell_to_field, *face) <= most * pair.shell_voxel;
}

/// Where contacts slid to. A pair that stands still need not search again.
struct SlideMemory {
  Stand stand;
  std::uint64_t sheet = 0;  ///< Sheet::version
  std::vector<Slid> slid;
};

/// The contacts that were chosen. While the pair stands still, no others are sought: a face touches with thousands of
/// points. Those of segments are in SegmentMemory.
struct ChoiceMemory {
  Stand stand;                              ///< where the pair stood when all were sought
  float reach = 0;                          ///< contact distance of that query, with the margins. [m]
  std::array<ContactPlace, 4> places{};     ///< rising
  std::array<std::uint32_t, 4> in_order{};  ///< their numbers, as they were chosen: the deepest was first
  std::size_t count = 0;
  bool none = false;  ///< there was no contact to choose
  [[nodiscard]] std::span<const ContactPlace> chosen() const { return {places.data(), count}; }
};

/// A proven distance between the bodies. As long as their relative pose has not changed by that much, no contacts are
/// sought.
struct GapMemory {
  Stand stand;
  double distance = 0;  ///< without margins; at most 0: none. [m]
  Stand sought;         ///< where it was last sought farther than contacts are
};

/// Of the other body's corners in the shell's body. As long as they have moved by less, none is deeper.
struct CornerMemory {
  Stand stand;     ///< of the other body in the shell's frame
  float most = 0;  ///< upper bound of V at all of them then, without margins. [m]
};

/// Whether a voxelmap is flat in a ball, and its plane. Field's frame.
struct KnownGround {
  Vec3 centre;       ///< [m]
  float radius = 0;  ///< 0: unknown. [m]
  HalfSpaceField plane;
  bool is_flat = false;
};

/// The last balls. There are two of each size for a shell that goes to and fro between them.
struct GroundMemory {
  std::array<KnownGround, 2> wide, narrow;
  std::array<KnownGround, 2> tops;  ///< nothing is above the plane, but parts may be missing below it
};

/// A place of a solid's face that has ground below it.
struct PlaceOnTops {
  Vec3 at;  ///< solid's frame. [m]
  std::uint32_t number = 0;
};

/// What stands on the plane over tops, see Partner::tops.
struct TopsMemory {
  Stand stand;             ///< where that was found out
  bool are_met = false;    ///< in the last step, by the points of a baked part
  std::uint32_t face = 0;  ///< corners with which a solid touches the plane, bits
  std::vector<PlaceOnTops> places;
};

/// What a pair remembers from step to step.
struct PairMemory {
  bool is_lasting = true;  ///< false: it is for one step
  ContactCache cache;
  SegmentMemory segments;
  SlideMemory slides;
  ChoiceMemory choice;
  GapMemory gap;
  CornerMemory corners;
  GroundMemory ground;
  /// The outward normal of a plane, or of a box's face that is wider than the shell, in each step since the other
  /// members' stands; else none. Field's frame.
  std::optional<Vec3> face;
  Stand now;                 ///< in this step
  bool touched = false;      ///< in the last one
  std::size_t contacts = 0;  ///< in the last one
  TopsMemory tops;
  bool is_carried = false;              ///< it rests or slides, without contacts ahead
  bool slides_along = false;            ///< it is carried because it slides along a face
  std::uint8_t falls_far = 0;           ///< for so many more steps
  std::array<std::uint32_t, 4> last{};  ///< features of the last contacts in slot 0
  std::size_t last_count = 0;

  [[nodiscard]] std::span<const std::uint32_t> last_features() const { return {last.data(), last_count}; }
  /// Whether it had as many contacts in the last step as a part that lies flat.
  [[nodiscard]] bool lay_flat() const noexcept { return contacts >= 3; }
  void remember(std::span<const ManifoldContact> few) noexcept {
    contacts = few.size();
    last_count = 0;
    for (const ManifoldContact& contact : few) {
      if (contact.slot == 0 && last_count < last.size()) last[last_count++] = contact.feature;
    }
  }
  /// A distance that the bodies surely have, without their margins. At most 0: none. [m]
  [[nodiscard]] double known_distance(const StepPair& pair) const noexcept {
    return gap.distance > 0 ? gap.distance - motion_between(pair.shell, gap.stand, pair.shell_to_field) : 0;
  }
  void leave_apart() noexcept {
    touched = is_carried = slides_along = false;
    tops = {};
    last_count = contacts = 0;
  }
};

/// Working memory of a thread: pairs may run in parallel, assets are immutable.
struct Workspace {
  Scratch scratch;
  ReductionScratch reduction;
  std::vector<float> rows[4];  // x, y, z, penetration
  std::vector<std::uint32_t> features, chosen;
  std::vector<float> nearest;
  Room<Contact> contacts;
  std::vector<Contact> on_map, seeds;
  SheetContacts on_sheet;
  std::vector<ManifoldContact> all, few;
  std::vector<SlidingContact> sliding;
};

}  // namespace vps::detail
