// SPDX-License-Identifier: Zlib
// Shapes in .bullet files: as boxes that carry the asset's key, and back.
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <LinearMath/btSerializer.h>

#include <cstdio>
#include <cstring>
#include <vector>

#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {
namespace {

constexpr std::string_view kPrefix = "vps:";
constexpr std::size_t kKeyLength = 4 + 16;

// The key in a shape's name, or nothing.
std::string_view key_in(const char* name) {
  const std::string_view whole = name != nullptr ? name : "";
  return whole.size() >= kKeyLength && whole.starts_with(kPrefix) ? whole.substr(0, kKeyLength) : std::string_view();
}

class Reattach {
 public:
  Reattach(const std::function<const char*(const btCollisionShape&)>& name_of,
           const std::function<Shape*(std::string_view)>& shape_for)
      : name_of_(name_of), shape_for_(shape_for) {}

  /// @return what should stand in the shape's place: itself, where nothing has to change
  btCollisionShape* in_place_of(btCollisionShape* shape) {
    if (shape->isCompound()) {
      auto* const compound = static_cast<btCompoundShape*>(shape);
      for (int i = 0; i < compound->getNumChildShapes(); ++i) {
        btCollisionShape* const child = compound->getChildShape(i);
        btCollisionShape* const other = in_place_of(child);
        if (other == child) continue;
        btCompoundShapeChild& entry = compound->getChildList()[i];
        entry.m_childShape = other;
        entry.m_childShapeType = other->getShapeType();
        // Its bounds in the compound's tree.
        compound->updateChildTransform(i, entry.m_transform);
      }
      return shape;
    }
    const std::string_view key = shape->getShapeType() == BOX_SHAPE_PROXYTYPE ? key_in(name_of_(*shape)) : "";
    Shape* const found = key.empty() ? nullptr : shape_for_(key);
    if (found == nullptr) return shape;
    ++count;
    return found;
  }

  int count = 0;

 private:
  const std::function<const char*(const btCollisionShape&)>& name_of_;
  const std::function<Shape*(std::string_view)>& shape_for_;
};

}  // namespace

std::string asset_key(const Asset& asset) {
  std::vector<std::uint64_t> hashes;
  for (const Section& section : asset.directory().sections) hashes.push_back(section.hash);
  hashes.push_back(asset.info().mesh_hash);
  char key[kKeyLength + 1];
  std::snprintf(key, sizeof key, "vps:%016llx",
                static_cast<unsigned long long>(hash_bytes(std::as_bytes(std::span(hashes)))));
  return key;
}

int Shape::calculateSerializeBufferSize() const {
  return sizeof(btConvexInternalShapeData);
}

const char* Shape::serialize(void* buffer, btSerializer* serializer) const {
  auto* const data = static_cast<btConvexInternalShapeData*>(buffer);
  std::memset(data, 0, sizeof *data);
  data->m_collisionShapeData.m_name =
      static_cast<char*>(serializer->getUniquePointer(const_cast<char*>(label_.data())));
  serializer->serializeName(label_.c_str());
  data->m_collisionShapeData.m_shapeType = BOX_SHAPE_PROXYTYPE;
  btVector3 low;
  btVector3 high;
  getAabb(btTransform::getIdentity(), low, high);
  ((high - low) / 2).serializeFloat(data->m_implicitShapeDimensions);
  scaling_.serializeFloat(data->m_localScaling);
  return "btConvexInternalShapeData";
}

int reattach(btCollisionWorld& world, const std::function<const char*(const btCollisionShape&)>& name_of,
             const std::function<Shape*(std::string_view)>& shape_for) {
  Reattach reattach(name_of, shape_for);
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    btCollisionObject* const object = world.getCollisionObjectArray()[i];
    btCollisionShape* const shape = reattach.in_place_of(object->getCollisionShape());
    if (shape == object->getCollisionShape()) continue;
    object->setCollisionShape(shape);
    world.getBroadphase()->getOverlappingPairCache()->cleanProxyFromPairs(object->getBroadphaseHandle(),
                                                                          world.getDispatcher());
    world.updateSingleAabb(object);
  }
  return reattach.count;
}

}  // namespace vps::bullet
