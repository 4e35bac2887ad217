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
#include "runtime/contacts/known_gap.h"
#include "runtime/contacts/side_contacts.h"

namespace vps::bullet {

enum class LookAhead : std::uint8_t { no, yes };

/// Whether a type of Bullet's shapes is a field for a pointshell.
inline bool is_partner_field(int type) {
  return btBroadphaseProxy::isConvex(type) || type == STATIC_PLANE_PROXYTYPE;
}

/// Bullet's concave shapes that hand out triangles.
inline bool is_triangle_mesh(int type) {
  return type == TRIANGLE_MESH_SHAPE_PROXYTYPE || type == SCALED_TRIANGLE_MESH_SHAPE_PROXYTYPE ||
         type == MULTIMATERIAL_TRIANGLE_MESH_PROXYTYPE || type == TERRAIN_SHAPE_PROXYTYPE ||
         type == GIMPACT_SHAPE_PROXYTYPE;
}

/// Pose of a body's field in its shape.
[[nodiscard]] btTransform field_frame(const PairBody& body);

/// Bullet's box about a shape.
[[nodiscard]] detail::FieldBox box_of(const PairBody& body);

/// One of Bullet's own shapes as a field.
using OwnField = std::variant<HalfSpaceField, BoxField, SphereField, RevolvedField, PolytopeField>;

/// A pair in a step before its roles and poses are known: a pair that is apart needs no more.
struct PairStep {
  StepMotion motions[2];    ///< of the first body, and of the second
  bool looks_ahead;         ///< whether contacts ahead are sought
  detail::SideQuery query;  ///< the same for both sides
  double reach;             ///< farthest distance at which contacts are sought, without the margins. [m]
  float margin;             ///< thickness of the pair by the margins of its Shapes. [m]
};
/// @param step      [s]
/// @param distance  at which surfaces are in contact in any case. [m]
/// @param ahead     no: contacts ahead are not sought. A pair that bounces has them only where it is too slow for that
/// @pre one of the bodies is a Shape
[[nodiscard]] PairStep step_of(const PairBody& first, const PairBody& second, btScalar step, btScalar distance,
                               LookAhead ahead);

/// How far ahead contacts of any of the bodies' parts are sought in a step.
struct WayAhead {
  btVector3 way{0, 0, 0};  ///< of the second body relative to the first, world. [m]
  btScalar around = 0;     ///< in any direction in addition. [m]
};
[[nodiscard]] WayAhead way_ahead(const PairBody& first, const PairBody& second, btScalar step, LookAhead ahead);

/// The pair for the engine-neutral path.
/// @param step  of the pair, whose first body gives the shell; null: without motions. Used by the result
[[nodiscard]] detail::StepPair in_step(const Pair& pair, const PairStep* step = nullptr);

/// The shapes of a pair as they were in the last step. While they do not change, what the pair remembers holds.
class SeenShapes {
 public:
  /// @return whether one of them is another one or has another size
  bool change_to(const PairBody& first, const PairBody& second) {
    if (shapes_[0].is_of(first) && shapes_[1].is_of(second)) return false;
    shapes_[0] = Seen(first);
    shapes_[1] = Seen(second);
    return true;
  }

 private:
  // No larger: it is compared in each step of each pair.
  struct Seen {
    std::uint64_t shape = 0;
    Vec3 size;
    float margin = 0;

    Seen() = default;
    explicit Seen(const PairBody& body)
        : shape(identity_of(body)), size(to_vec3(size_of(body))), margin(margin_of(body)) {}
    [[nodiscard]] bool is_of(const PairBody& body) const {
      const Vec3 now = to_vec3(size_of(body));
      return shape == identity_of(body) && size.x == now.x && size.y == now.y && size.z == now.z &&
             margin == margin_of(body);
    }
  };
  // A new shape may lie where another one was. Pointers have no bits so high.
  static std::uint64_t identity_of(const PairBody& body) {
    if (body.vps != nullptr) return std::uint64_t{1} << 63 | body.vps->serial();
    return reinterpret_cast<std::uintptr_t>(body.shape) ^ std::uint64_t(body.shape->getShapeType()) << 56;
  }
  // The scaling, or what it is part of. A sphere's size is its margin.
  static const btVector3& size_of(const PairBody& body) {
    if (body.vps != nullptr) return body.vps->getLocalScaling();  // these calls need no look-up
    switch (body.shape->getShapeType()) {
      case BOX_SHAPE_PROXYTYPE:
      case CAPSULE_SHAPE_PROXYTYPE:
      case CYLINDER_SHAPE_PROXYTYPE:
        return static_cast<const btConvexInternalShape*>(body.shape)->getImplicitShapeDimensions();
      default:
        return body.shape->getLocalScaling();
    }
  }
  static float margin_of(const PairBody& body) {
    return static_cast<float>(body.vps != nullptr ? body.vps->getMargin() : body.shape->getMargin());
  }

  Seen shapes_[2];
};

inline detail::PlaceRef<btScalar> place_of(const PairBody& body) {
  return {body.world.getBasis()[0].m_floats, body.world.getOrigin().m_floats};
}
/// Radius of a sphere about the body's origin that holds its surface; infinite for Bullet's own shapes. [m]
[[nodiscard]] float arm_of(const PairBody& body);

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
  std::array<Vec3, 8> corners_;  // of a box; the first: the tip of a cone
};

}  // namespace vps::bullet
