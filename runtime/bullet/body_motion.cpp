// SPDX-License-Identifier: Zlib
// Velocities, forces and paths of rigid bodies and of the links of multibodies (Featherstone 1987; Mirtich 1996).
#include "runtime/bullet/body_motion.h"

#include <BulletCollision/CollisionShapes/btCollisionShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>
#include <LinearMath/btTransformUtil.h>

namespace vps::bullet {
namespace {

// The motion that a joint gives its link, relative to the parent, in the link's frame.
Velocity joint_velocity(const btMultiBody& multibody, int link) {
  const btMultibodyLink& joint = multibody.getLink(link);
  const btScalar* const speeds = multibody.getJointVelMultiDof(link);
  Velocity velocity;
  for (int dof = 0; dof < joint.m_dofCount; ++dof) {
    velocity.angular += speeds[dof] * joint.getAxisTop(dof);
    velocity.linear += speeds[dof] * joint.getAxisBottom(dof);
  }
  return velocity;
}

// Whether the solver moves a link: its base or a joint between them is free.
bool is_free(const btMultiBodyLinkCollider& collider) {
  const btMultiBody& multibody = *collider.m_multiBody;
  if (collider.isStaticOrKinematicObject()) return false;
  for (int link = collider.m_link; link >= 0; link = multibody.getParent(link)) {
    if (multibody.getLink(link).m_dofCount > 0 && !multibody.isLinkStaticOrKinematic(link)) return true;
  }
  return !multibody.hasFixedBase() && !multibody.isBaseStaticOrKinematic();
}

btScalar mass_of(const btMultiBodyLinkCollider& collider) {
  return collider.m_link < 0 ? collider.m_multiBody->getBaseMass() : collider.m_multiBody->getLinkMass(collider.m_link);
}

btVector3 base_acceleration(const btMultiBody& multibody) {
  if (multibody.hasFixedBase() || multibody.isBaseStaticOrKinematic() || !(multibody.getBaseMass() > 0)) {
    return {0, 0, 0};
  }
  return multibody.getBaseForce() / multibody.getBaseMass();
}

// Pose of a link in its parent, some time before the present.
btTransform pose_in_parent(const btMultiBody& multibody, int link, btScalar before) {
  btMultibodyLink joint = multibody.getLink(link);
  const btScalar* const speeds = multibody.getJointVelMultiDof(link);
  btScalar* const q = joint.m_jointPos;
  if (joint.m_jointType == btMultibodyLink::eSpherical) {
    const btVector3 turn(speeds[0], speeds[1], speeds[2]);
    if (turn.length2() > 0) {
      const btQuaternion then =
          btQuaternion(q[0], q[1], q[2], q[3]) * btQuaternion(turn.normalized(), -before * turn.length());
      for (int i = 0; i < 4; ++i) q[i] = then[i];
    }
  } else if (joint.m_jointType == btMultibodyLink::ePlanar) {
    const btVector3 &x = joint.getAxisBottom(1), &y = joint.getAxisBottom(2);
    const btVector3 way = quatRotate(btQuaternion(joint.getAxisTop(0), q[0]), speeds[1] * x + speeds[2] * y);
    q[0] -= before * speeds[0];
    q[1] -= before * x.dot(way);
    q[2] -= before * y.dot(way);
  } else if (joint.m_dofCount > 0) {
    q[0] -= before * speeds[0];
  }
  joint.updateCacheMultiDof();
  const btQuaternion to_parent = joint.m_cachedRotParentToThis.inverse();
  return btTransform(to_parent, quatRotate(to_parent, joint.m_cachedRVector));
}

// Radius of a sphere about an object's origin that holds it. [m]
btScalar reach_of(const btCollisionObject& object) {
  btVector3 centre;
  btScalar radius = 0;
  object.getCollisionShape()->getBoundingSphere(centre, radius);
  return radius + centre.length();
}

}  // namespace

// Sums the motions of the joints from the link up to the base. Their poses follow from the link's own: Bullet updates
// those of links without colliders only while it solves.
Velocity link_velocity(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* const collider = btMultiBodyLinkCollider::upcast(&object);
  if (collider == nullptr) return {};
  const btMultiBody& multibody = *collider->m_multiBody;
  const btVector3& place = object.getWorldTransform().getOrigin();
  Velocity sum;
  btTransform at = object.getWorldTransform();
  for (int link = collider->m_link; link >= 0; link = multibody.getParent(link)) {
    const Velocity joint = joint_velocity(multibody, link);
    const btVector3 angular = at.getBasis() * joint.angular;
    sum.angular += angular;
    sum.linear += at.getBasis() * joint.linear + angular.cross(place - at.getOrigin());
    at.getOrigin() -= at.getBasis() * multibody.getRVector(link);
    at.getBasis() = at.getBasis() * btMatrix3x3(multibody.getParentToLocalRot(link));
  }
  sum.angular += multibody.getBaseOmega();
  sum.linear += multibody.getBaseVel() + multibody.getBaseOmega().cross(place - at.getOrigin());
  return sum;
}

btScalar link_inverse_mass(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object);
  if (link == nullptr || !is_free(*link) || !(mass_of(*link) > 0)) return 0;
  return 1 / mass_of(*link);
}

btVector3 local_inertia(const btCollisionObject& object) {
  if (const btRigidBody* const body = btRigidBody::upcast(&object)) return body->getLocalInertia();
  const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object);
  if (link == nullptr) return {0, 0, 0};
  return link->m_link < 0 ? link->m_multiBody->getBaseInertia() : link->m_multiBody->getLinkInertia(link->m_link);
}

btVector3 link_acceleration(const btCollisionObject& object) {
  const btMultiBodyLinkCollider* const link = btMultiBodyLinkCollider::upcast(&object);
  if (link == nullptr) return {0, 0, 0};
  const btMultiBody& multibody = *link->m_multiBody;
  return inverse_mass(object) * (link->m_link < 0 ? multibody.getBaseForce() : multibody.getLinkForce(link->m_link));
}

PastMotion::PastMotion(btCollisionObject& object, btScalar step)
    : object_(&object), step_(step), start_(object.getWorldTransform()) {
  if (object.isKinematicObject()) {
    const Velocity velocity = velocity_of(object);
    drift_ = velocity.linear;
    spin_ = velocity.angular;
    swing_ = spin_.length() * reach_of(object);
    return;
  }
  if (inverse_mass(object) == 0 || !object.isActive() || object.isStaticOrKinematicObject()) return;
  btScalar reach = reach_of(object);
  body_ = btRigidBody::upcast(&object);
  if (body_ != nullptr) {
    drift_ = body_->getLinearVelocity();
    spin_ = body_->getAngularVelocity();
    btTransformUtil::integrateTransform(object.getWorldTransform(), -drift_, -spin_, step, start_);
  } else {
    const btMultiBodyLinkCollider& collider = *btMultiBodyLinkCollider::upcast(&object);
    multibody_ = collider.m_multiBody;
    link_ = collider.m_link;
    drift_ = multibody_->getBaseVel();
    spin_ = multibody_->getBaseOmega();
    for (int link = link_; link >= 0; link = multibody_->getParent(link)) {
      const Velocity joint = joint_velocity(*multibody_, link);
      swing_ += joint.angular.length() * reach + joint.linear.length();
      reach += multibody_->getRVector(link).length() + step * joint.linear.length();
    }
  }
  swing_ += spin_.length() * reach;
}

btTransform PastMotion::base_at(btScalar time) const {
  btTransform base;
  btTransformUtil::integrateTransform(multibody_->getBaseWorldTransform(), -drift_, -spin_, step_ - time, base);
  return base;
}

btTransform PastMotion::at(btScalar time) const {
  if (multibody_ != nullptr) {
    btTransform pose = btTransform::getIdentity();
    for (int link = link_; link >= 0; link = multibody_->getParent(link)) {
      pose = pose_in_parent(*multibody_, link, step_ - time) * pose;
    }
    return base_at(time) * pose;
  }
  btTransform pose;
  btTransformUtil::integrateTransform(start_, drift_, spin_, time, pose);
  return pose;
}

void PastMotion::put_back(btScalar time, const btTransform& carried) const {
  const btVector3 given =
      (step_ - time) * (multibody_ != nullptr ? base_acceleration(*multibody_) : acceleration_of(*object_));
  const btScalar left = given.length2() > 0 ? drift_.dot(given) / given.length2() : 0;
  const btVector3 velocity = drift_ - btClamped(left, btScalar(0), btScalar(1)) * given;
  if (body_ != nullptr) {
    body_->setCenterOfMassTransform(carried * at(time));
    body_->setLinearVelocity(velocity);
    return;
  }
  multibody_->stepPositionsMultiDof(time - step_);
  btAlignedObjectArray<btQuaternion> rotations;
  btAlignedObjectArray<btVector3> origins;
  multibody_->forwardKinematics(rotations, origins);
  multibody_->updateCollisionObjectWorldTransforms(rotations, origins);
  multibody_->setBaseVel(velocity);
}

}  // namespace vps::bullet
