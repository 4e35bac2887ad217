// SPDX-License-Identifier: Zlib
/// @file What a pointshell can meet: baked bodies, Bullet's own convex shapes and planes as fields, its meshes as
/// sheets. Internal.
#pragma once

#include <array>
#include <optional>
#include <variant>

#include "runtime/bullet/pair.h"
#include "runtime/bullet/partners/convex_planes.h"
#include "runtime/bullet/partners/triangle_contacts.h"
#include "runtime/contacts/side_contacts.h"

namespace vps::bullet {

/// Whether a type of Bullet's shapes is a field for a pointshell.
inline bool is_partner_field(int type) {
  return btBroadphaseProxy::isConvex(type) || type == STATIC_PLANE_PROXYTYPE;
}

/// Pose of a body's field in its shape.
[[nodiscard]] btTransform field_frame(const PairBody& body);

/// Bullet's box about a shape.
[[nodiscard]] detail::PlacedBox box_of(const PairBody& body);

/// One of Bullet's own shapes as a field.
using OwnField = std::variant<HalfSpaceField, BoxField, SphereField, RevolvedField, PolytopeField>;

/// The pair for the engine-neutral path.
[[nodiscard]] detail::StepPair in_step(const Pair& pair);
/// Adds how the bodies move, for contacts ahead. None for a pair with restitution: they would remove the bounce.
/// @param motions  used by `out`
void add_motions(const Pair& pair, btScalar step, StepMotion (&motions)[2], detail::StepPair& out);

/// Working memory of the calling thread.
[[nodiscard]] detail::Workspace& workspace();

/// The partner of a pair, and what is remembered of its shape.
class PairPartner final : private detail::Sheet {
 public:
  /// Valid until the next call.
  /// @param has_way  whether contacts ahead are sought
  /// @return none for a shape that is not supported
  [[nodiscard]] std::optional<detail::Partner> of(const Pair& pair, bool has_way);
  [[nodiscard]] const TriangleMemory& triangles() const { return triangles_; }

 private:
  Status find(const QueryOptions& options, std::span<const detail::ContactPlace> known,
              detail::SheetContacts& found) override;
  [[nodiscard]] std::uint64_t version() const override { return triangles_.mesh; }
  void slide(const detail::PlacedField& distances, detail::Slides& slides) const override;

  const Pair* pair_ = nullptr;
  OwnField field_;
  ConvexPlanes planes_;
  TriangleMemory triangles_;
  std::array<Vec3, detail::kMostCorners> corners_;
};

}  // namespace vps::bullet
