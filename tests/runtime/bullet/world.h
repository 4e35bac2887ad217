// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bullet worlds with assets baked from simple shapes.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "tests/support/baked.h"
#include "tests/support/bullet_world.h"
#include "tests/support/shapes.h"

namespace vps::test {

inline std::shared_ptr<Asset> baked_at(const TriangleMesh& mesh, double voxel_size) {
  bake::BakeOptions options;
  options.voxel_size = voxel_size;
  return baked(mesh, options);
}

// Bodies that many tests use.
inline std::shared_ptr<Asset> ball() {
  return baked_at(make_sphere(0.05, 4), 0.003);
}
inline std::shared_ptr<Asset> brick() {
  return baked_at(make_box({0.05, 0.05, 0.05}), 0.004);
}
inline std::shared_ptr<Asset> torus() {
  return baked_at(make_torus(0.1, 0.03, 64, 32), 0.004);
}

inline double speed(const btRigidBody& body) {
  return double(body.getLinearVelocity().length()) + 0.05 * double(body.getAngularVelocity().length());
}

/// Number of manifolds with a contact; expects at most one contact in each.
inline int count_single_contacts(World& scene) {
  int manifolds = 0;
  for (int m = 0; m < scene.dispatcher.getNumManifolds(); ++m) {
    const int contacts = scene.dispatcher.getManifoldByIndexInternal(m)->getNumContacts();
    EXPECT_LE(contacts, 1);
    manifolds += contacts;
  }
  return manifolds;
}

/// For contactTest and contactPairTest.
struct CollectContacts final : btCollisionWorld::ContactResultCallback {
  std::vector<btManifoldPoint> points;
  std::vector<const btCollisionObject*> first;
  btScalar addSingleResult(btManifoldPoint& p, const btCollisionObjectWrapper* a, int, int,
                           const btCollisionObjectWrapper*, int, int) override {
    points.push_back(p);
    first.push_back(a->getCollisionObject());
    return 0;
  }
};

}  // namespace vps::test
