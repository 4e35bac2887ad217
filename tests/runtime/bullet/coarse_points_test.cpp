// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies that rest on round feet, with points as far apart as the feet are round.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/runtime/bullet/world.h"

namespace vps::test {
namespace {

constexpr double kVoxel = 0.0005;
constexpr double kFoot = 0.007;  // radius. [m]
constexpr double kArm = 0.015;   // from the body's centre to that of a foot. [m]
constexpr double kTop = 0.02;    // of the grounds, above their middles. [m]

// Four balls at the corners of a tetrahedron.
TriangleMesh feet() {
  const double a = kArm / std::sqrt(3.0);
  TriangleMesh mesh;
  for (const std::array<double, 3>& at : {std::array{a, a, a}, {a, -a, -a}, {-a, a, -a}, {-a, -a, a}}) {
    mesh = joined(mesh, make_sphere(kFoot, 4, at));
  }
  return mesh;
}

// Surfaces between coarse points reach into the ground before the points do.
TEST(CoarsePoints, BodiesComeToRestOnRoundFeet) {
  btStaticPlaneShape plane({0, 0, 1}, btScalar(kTop));
  btBoxShape box({btScalar(0.2), btScalar(0.2), btScalar(kTop)});
  bullet::Shape slab(baked_at(make_box({0.2, 0.2, kTop}), 0.002));
  for (const double alpha : {3.0, 4.0, 6.0}) {
    bake::BakeOptions options;
    options.voxel_size = kVoxel;
    options.alpha = alpha;
    bullet::Shape body(baked(feet(), options));
    for (btCollisionShape* const ground : {static_cast<btCollisionShape*>(&plane), static_cast<btCollisionShape*>(&box),
                                           static_cast<btCollisionShape*>(&slab)}) {
      for (const double turn : {0.3, 1.1, 2.0}) {
        World scene(kVoxel);
        scene.world.getSolverInfo().m_solverMode |= SOLVER_USE_2_FRICTION_DIRECTIONS;
        scene.world.getSolverInfo().m_numIterations = 50;
        scene.add(*ground, 0, {0, 0, 0});
        const btQuaternion rotation(btVector3(1, btScalar(turn), btScalar(0.2)).normalized(), btScalar(turn));
        btRigidBody& falls = scene.add(body, 1, btTransform(rotation, {0, 0, btScalar(kTop + 0.05)}));
        constexpr auto kStep = btScalar(1.0 / 200);
        scene.step(500, kStep);
        btScalar fastest = 0;
        for (int i = 0; i < 50; ++i) {
          scene.step(1, kStep);
          fastest = std::max(fastest, falls.getAngularVelocity().length());
        }
        EXPECT_LT(fastest, 0.01) << "alpha " << alpha << " on " << ground->getName() << ", turned by " << turn;
      }
    }
  }
}

}  // namespace
}  // namespace vps::test
