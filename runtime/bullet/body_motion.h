// SPDX-License-Identifier: Zlib
/// @file How an object of a world moves: a rigid body, a link or the base of a multibody, or an object that does not
/// move. Internal.
#pragma once

#include <BulletDynamics/Dynamics/btRigidBody.h>
#include <hwy/cache_control.h>

class btMultiBody;

namespace vps::bullet {

struct Velocity {
  btVector3 linear{0, 0, 0};   ///< of the object's origin. [m/s]
  btVector3 angular{0, 0, 0};  ///< [rad/s]
};

// Each pair calls the functions below in each step, and most objects are rigid bodies. These are for links.
[[nodiscard]] Velocity link_velocity(const btCollisionObject& object);
[[nodiscard]] btScalar link_inverse_mass(const btCollisionObject& object);
[[nodiscard]] btVector3 link_acceleration(const btCollisionObject& object);

/// Starts to read what the functions below need. In a scene with thousands of bodies it comes from memory.
inline void fetch_motion(const btCollisionObject& object) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  if (body == nullptr) return;
  hwy::Prefetch(&body->getLinearVelocity());
  hwy::Prefetch(&body->getAngularVelocity());
  hwy::Prefetch(&body->getTotalForce());
}

/// Zero for objects that do not move.
[[nodiscard]] inline Velocity velocity_of(const btCollisionObject& object) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  if (body == nullptr) return link_velocity(object);
  // A kinematic body is mostly marked as static, too.
  const bool moves = !body->isStaticObject() || body->isKinematicObject();
  return moves ? Velocity{body->getLinearVelocity(), body->getAngularVelocity()} : Velocity{};
}

/// 0 for objects that the solver does not move. That of a link alone: its joints only make it harder to move. [1/kg]
[[nodiscard]] inline btScalar inverse_mass(const btCollisionObject& object) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  return body != nullptr ? body->getInvMass() : link_inverse_mass(object);
}

/// By the forces of the step, without what joints and contacts do. [m/s^2]
[[nodiscard]] inline btVector3 acceleration_of(const btCollisionObject& object) {
  const btRigidBody* const body = btRigidBody::upcast(&object);
  return body != nullptr ? body->getInvMass() * body->getTotalForce() : link_acceleration(object);
}

/// Moments of inertia about the object's axes; zero for objects that are neither rigid bodies nor links. [kg m^2]
[[nodiscard]] btVector3 local_inertia(const btCollisionObject& object);

/// The motion of an object in the step that has just ended. Links move with their joints, along arcs. A kinematic
/// object was at its pose when the step began, and the solver let it go on with its velocity: so it does here.
class PastMotion {
 public:
  /// @param step  [s]
  PastMotion(btCollisionObject& object, btScalar step);

  /// Whether the solver moved it. Static and sleeping objects stand still here.
  [[nodiscard]] bool moves() const { return body_ != nullptr || multibody_ != nullptr; }
  /// Null for all but links.
  [[nodiscard]] btMultiBody* multibody() const { return multibody_; }
  /// @param time  since the step's start, up to `step`. [s]
  [[nodiscard]] btTransform at(btScalar time) const;
  /// Constant velocity that all of its points share. [m/s]
  [[nodiscard]] const btVector3& drift() const { return drift_; }
  /// Upper bound of the speed of any of its points in addition to `drift`. [m/s]
  [[nodiscard]] btScalar swing() const { return swing_; }
  /// Upper bound of the speed of any of its points. [m/s]
  [[nodiscard]] btScalar speed() const { return drift_.length() + swing_; }

  /// Sets the object, for a link its whole multibody, to its pose and velocity at a time. Subtracts the velocity that
  /// forces give in the rest of the step, but no more than the body still has: contacts may have taken some of it.
  /// Joints keep their velocities.
  /// @param carried  motion of an object that is no link after that, in the world
  void put_back(btScalar time, const btTransform& carried) const;

 private:
  [[nodiscard]] btTransform base_at(btScalar time) const;

  btCollisionObject* object_;
  btScalar step_;
  btRigidBody* body_ = nullptr;
  btMultiBody* multibody_ = nullptr;
  int link_ = -1;  // of the multibody; -1: its base
  btTransform start_;
  btVector3 drift_{0, 0, 0}, spin_{0, 0, 0};  // of the body or base
  btScalar swing_ = 0;
};

}  // namespace vps::bullet
