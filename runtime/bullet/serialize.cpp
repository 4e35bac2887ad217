// SPDX-License-Identifier: Zlib
// Writes Shapes to .bullet files as boxes that carry the asset's key, and restores them.
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <LinearMath/btSerializer.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include "runtime/bullet/partners/for_each_leaf.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::bullet {
namespace {

std::uint64_t hash_of(const Asset& asset) {
  std::vector<std::uint64_t> hashes;
  for (const Section& section : asset.directory().sections) hashes.push_back(section.hash);
  hashes.push_back(asset.info().mesh_hash);
  return hash_bytes(std::as_bytes(std::span(hashes)));
}

// Encodes 28 bits of the hash as a margin below 2^-90 m, which is too small to have an effect. A file keeps margins bit
// by bit, but not the names of compounds' children.
float tag_of(const Asset& asset) {
  const std::uint64_t hash = hash_of(asset);
  const float fraction = 1 + std::ldexp(static_cast<float>(hash & 0x7FFFFF), -23);
  return std::ldexp(fraction, -91 - static_cast<int>((hash >> 23) & 31));
}

btVector3 half_extents(const btCollisionShape& shape) {
  btVector3 low;
  btVector3 high;
  shape.getAabb(btTransform::getIdentity(), low, high);
  return (high - low) / 2;
}

class Reattach {
 public:
  explicit Reattach(std::span<Shape* const> shapes) : shapes_(shapes) {}

  /// @return the shape's replacement; the shape itself where nothing has to change
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
        // Updates the child's bounds in the compound's tree.
        compound->updateChildTransform(i, entry.m_transform);
      }
      return shape;
    }
    if (shape->getShapeType() != BOX_SHAPE_PROXYTYPE) return shape;
    for (Shape* const candidate : shapes_) {
      if (shape->getMargin() != btScalar(tag_of(candidate->asset()))) continue;
      const btVector3 wanted = half_extents(*candidate);
      const btVector3 margin(candidate->getMargin(), candidate->getMargin(), candidate->getMargin());
      if ((half_extents(*shape) - (wanted - margin)).length() > btScalar(1e-3) * wanted.length()) continue;
      ++count;
      return candidate;
    }
    return shape;
  }

  int count = 0;

 private:
  const std::span<Shape* const> shapes_;
};

}  // namespace

std::string asset_key(const Asset& asset) {
  char key[32];
  std::snprintf(key, sizeof key, "vps:%016llx", static_cast<unsigned long long>(hash_of(asset)));
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
  const btVector3 margin(getMargin(), getMargin(), getMargin());
  (half_extents(*this) - margin).serializeFloat(data->m_implicitShapeDimensions);
  data->m_collisionMargin = tag_of(*asset_);
  scaling_.serializeFloat(data->m_localScaling);
  return "btConvexInternalShapeData";
}

int reattach(btCollisionWorld& world, std::span<Shape* const> shapes) {
  Reattach reattach(shapes);
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    btCollisionObject* const object = world.getCollisionObjectArray()[i];
    btCollisionShape* const shape = reattach.in_place_of(object->getCollisionShape());
    btRigidBody* const body = btRigidBody::upcast(object);
    if (shape != object->getCollisionShape() && body != nullptr && body->getInvMass() > 0) {
      const btScalar mass = 1 / body->getInvMass();
      btVector3 inertia;
      shape->calculateLocalInertia(mass, inertia);
      body->setMassProps(mass, inertia);
      body->updateInertiaTensor();
    }
    object->setCollisionShape(shape);
  }
  if (reattach.count == 0) return 0;
  // After all: bodies may share a compound.
  for (int i = 0; i < world.getNumCollisionObjects(); ++i) {
    btCollisionObject* const object = world.getCollisionObjectArray()[i];
    bool has_shape = false;
    for_each_leaf(*object, [&](const Leaf& leaf) {
      has_shape = has_shape || std::find(shapes.begin(), shapes.end(), leaf.shape) != shapes.end();
    });
    if (!has_shape) continue;
    world.getBroadphase()->getOverlappingPairCache()->cleanProxyFromPairs(object->getBroadphaseHandle(),
                                                                          world.getDispatcher());
    world.updateSingleAabb(object);
  }
  return reattach.count;
}

}  // namespace vps::bullet
