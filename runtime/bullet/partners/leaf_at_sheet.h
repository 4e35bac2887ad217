// SPDX-License-Identifier: Zlib
/// @file A leaf of the shell at the triangles near it. Internal.
#pragma once

#include <array>
#include <optional>

#include "runtime/bullet/partners/sheet_part.h"

namespace vps::bullet {

/// A point of a solid body over a face of the sheet, which is the nearest place of it.
struct PointOverFace {
  std::uint32_t point;
  Vec3 at;
  const Triangle* face;  ///< null: the point is not over a face; what follows is not set
  float height;          ///< of the point. [m]
  float along;           ///< cosine of the angle between the body's inward normal and the face's
  float side;            ///< where the body's material is: SolidBody::side_of

  /// Sets all but `side`.
  /// @param relevant  contacts farther off do not count. [m]
  /// @return false in the most frequent case, decided without the field: it looks at the sheet from farther off
  bool look(const SolidBody& body, std::uint32_t number, Vec3 p, const Triangle& triangle, float relevant) noexcept;
};

/// Some of a leaf's points, in the order of the shell.
struct LeafPoints {
  std::array<PointOverFace, detail::Spheres::kMost> all;
  std::uint32_t count = 0;
};

/// A place of the sheet in the body, or near it.
struct PlaceOnSheet {
  Vec3 at;
  float penetration = 0;  ///< V. [m]
  Vec3 out;               ///< unit, out of the body; zero where the field has no slope
};

class LeafAtSheet {
 public:
  static constexpr float kRounding = 1e-4F;  ///< of distances, as a share of them

  /// @param part   the triangles within reach of the leaf's sphere
  /// @param least  none of them is nearer to its centre. [m^2]
  LeafAtSheet(const SolidBody& body, const SheetPart& part, std::uint32_t node, float least) noexcept
      : body_(body),
        part_(part),
        centre_(sphere_centre(body.shell, node)),
        radius_(sphere_radius(body.shell, node)),
        gap_((1 - kRounding) * std::sqrt(least) - radius_) {}

  /// The sphere round the leaf's points.
  [[nodiscard]] Vec3 centre() const noexcept { return centre_; }
  /// The body's surface at the leaf is no farther from the sphere's centre. [m]
  [[nodiscard]] float extent() const noexcept { return radius_ + body_.shell.covering_radius; }
  /// No point of the leaf is nearer to a triangle; negative where the sphere meets one. [m]
  [[nodiscard]] float gap() const noexcept { return gap_; }

  /// Whether the sheet ends or bends within reach of the leaf.
  bool ends_near();
  /// Whether the sheet may enter the body at the leaf.
  [[nodiscard]] bool meets_sheet() const noexcept;
  /// Whether the leaf's only contacts are its points before faces, which press no deeper than -gap. Proof:
  /// docs/internals/bounds.md, "Leaves before a sheet". Never of a body without samples.
  bool is_before_sheet();

  /// What points of the leaf are to the sheet; without those that are not in reach of it, or look at it from far.
  /// @param points  at most Spheres::kMost
  /// @param wanted  points over faces that press less are left out; only of a leaf before the sheet. [m]
  void look_at(IndexRange points, float relevant, float wanted, LeafPoints& out) const;

  /// Follows the sheet from a place while it gets deeper into the body.
  /// @pre the body has a field; so for `is_end`
  [[nodiscard]] PlaceOnSheet climb(Vec3 from) const;
  /// Whether the sheet ends or bends at such a place, so that it is a contact.
  [[nodiscard]] bool is_end(const PlaceOnSheet& place) const;

  bool has_climbed = false;  ///< along the sheet, from one of the points

 private:
  // V of layers depends on a normal.
  [[nodiscard]] bool has_samples() const noexcept { return body_.has_field() && body_.map.field != Field::layers; }
  [[nodiscard]] bool has_sheet_within(float near, Vec3 place) const;

  const SolidBody& body_;
  const SheetPart& part_;
  const Vec3 centre_;
  const float radius_;
  const float gap_;
  std::optional<bool> ends_near_;
};

}  // namespace vps::bullet
