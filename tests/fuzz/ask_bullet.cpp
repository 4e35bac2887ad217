// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/fuzz/ask_bullet.h"

#include "tests/fuzz/answers.h"
#include "tests/support/bullet_world.h"

namespace vps::test {
namespace {

bool is_finite(const btVector3& v) {
  return std::isfinite(v.x()) && std::isfinite(v.y()) && std::isfinite(v.z());
}

}  // namespace

void ask_bullet(const std::shared_ptr<const Asset>& asset, const std::shared_ptr<const Asset>& sound) {
  bullet::set_message_handler([](const char*) {});
  bullet::Shape strange(asset);
  bullet::Shape known(sound);
  const bullet::Shape principal(asset, bullet::Part::mixed, bullet::Axes::principal);
  btVector3 inertia;
  principal.calculateLocalInertia(1, inertia);
  expect(is_finite(inertia), "the inertia about principal axes");
  btBoxShape box(btVector3(btScalar(0.05), btScalar(0.05), btScalar(0.05)));
  btStaticPlaneShape ground(btVector3(0, 0, 1), 0);
  for (const btScalar strange_mass : {btScalar(0), btScalar(1)}) {
    World world;
    world.add(ground, 0, btVector3(0, 0, btScalar(-0.5)));
    world.add(strange, strange_mass, btVector3(0, 0, 0));
    const btRigidBody& baked = world.add(known, 1, btVector3(btScalar(0.02), 0, btScalar(0.1)));
    const btRigidBody& crate = world.add(box, 1, btVector3(0, btScalar(0.02), btScalar(-0.1)));
    world.step(8);
    for (const btRigidBody* const body : {&baked, &crate}) {
      expect(is_finite(body->getWorldTransform().getOrigin()), "the place of a body beside the asset");
      expect(is_finite(body->getAngularVelocity()), "the rotation of a body beside the asset");
    }
  }
}

}  // namespace vps::test
