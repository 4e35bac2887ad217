// SPDX-License-Identifier: Zlib
// Takes the corners of Bullet's polyhedra.
#include "runtime/bullet/partners/corner_contacts.h"

#include <BulletCollision/CollisionShapes/btPolyhedralConvexShape.h>

#include <array>

namespace vps::bullet {

bool add_corner_contacts(const Pair& pair, const btTransform& frame, float reach, std::vector<Contact>& contacts) {
  const int type = pair.field.shape->getShapeType();
  if (type != BOX_SHAPE_PROXYTYPE && type != CONVEX_HULL_SHAPE_PROXYTYPE) return false;
  const VoxelmapView& map = pair.shell.vps->distances();
  if (map.field == Field::none) return false;
  const auto& solid = static_cast<const btPolyhedralConvexShape&>(*pair.field.shape);
  if (static_cast<std::uint32_t>(solid.getNumVertices()) > detail::kMostCorners) return false;
  // The corners of a box are those of its faces; a hull is rounded by its margin.
  const float margin = type == BOX_SHAPE_PROXYTYPE ? 0 : static_cast<float>(solid.getMargin());
  std::array<Vec3, detail::kMostCorners> places;
  const auto count = static_cast<std::size_t>(solid.getNumVertices());
  for (std::size_t i = 0; i < count; ++i) {
    btVector3 vertex;
    solid.getVertex(static_cast<int>(i), vertex);
    places[i] = to_vec3(vertex);
  }
  return detail::add_corner_contacts(map, pair.shell.vps->pointshell(), to_asset(pair, frame),
                                     {{places.data(), count}, margin}, reach, contacts);
}

}  // namespace vps::bullet
