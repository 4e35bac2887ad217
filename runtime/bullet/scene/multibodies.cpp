// SPDX-License-Identifier: Zlib
// Makes Bullet's multibodies from the joints of a manifest.
#include "runtime/bullet/scene/multibodies.h"

#include <BulletDynamics/Featherstone/btMultiBodyJointLimitConstraint.h>

#include <limits>
#include <set>

namespace vps::bullet {
namespace {

using manifest::kFarthest;
using manifest::Refusal;
using manifest::Value;

// Bodies and joints of one multibody. Joints are in the manifest's order: parents come first.
struct Tree {
  std::size_t base = Joint::kWorld;
  std::vector<const Joint*> joints;
};

std::vector<Tree> grow_trees(const std::vector<Joint>& joints) {
  std::vector<Tree> trees;
  std::map<std::size_t, std::size_t> tree_of;  // by bodies
  for (const Joint& joint : joints) {
    const bool is_rooted = joint.parent == Joint::kWorld;
    const auto known = is_rooted ? tree_of.end() : tree_of.find(joint.parent);
    const std::size_t tree = known == tree_of.end() ? trees.size() : known->second;
    if (tree == trees.size()) trees.push_back({joint.parent, {}});
    if (!is_rooted) tree_of.emplace(joint.parent, tree);
    tree_of.emplace(joint.child, tree);
    // Bullet allocates as many numbers as the square of the joints.
    if (trees[tree].joints.size() == scene_manifest::kMostJoints) {
      throw Refusal{"a multibody has more than " + std::to_string(scene_manifest::kMostJoints) + " joints"};
    }
    trees[tree].joints.push_back(&joint);
  }
  return trees;
}

void set_up(btMultiBody& multibody, int link, int parent, const btTransform& parent_frame, const BodyParts& body,
            const Joint& joint) {
  const btTransform in_parent = parent_frame.inverse() * joint.pose;
  const btTransform in_body = body.frame.inverse();
  const btQuaternion turn = in_body.getRotation() * in_parent.getRotation().inverse();
  const btVector3 axis = in_body.getBasis() * joint.axis;
  constexpr bool kApart = true;  // parent and child do not meet
  if (joint.type == Joint::Type::prismatic) {
    multibody.setupPrismatic(link, body.mass, body.inertia, parent, turn, axis, in_parent.getOrigin(),
                             -in_body.getOrigin(), kApart);
  } else {
    multibody.setupRevolute(link, body.mass, body.inertia, parent, turn, axis, in_parent.getOrigin(),
                            -in_body.getOrigin(), kApart);
  }
}

}  // namespace

std::vector<Joint> read_joints(const Value& list, const std::vector<BodyParts>& bodies,
                               const std::map<std::string, std::size_t, std::less<>>& numbers) {
  std::vector<Joint> joints;
  std::set<std::string> names;
  std::set<std::size_t> held;  // bodies that a joint has named
  for (const Value& value : list.list(scene_manifest::kMostBodies)) {
    value.allow_only({"name", "type", "parent", "child", "position", "orientation", "axis", "lower", "upper"});
    const auto body = [&](const char* key) {
      const auto it = numbers.find(value[key].text());
      if (it == numbers.end()) value[key].refuse("is not the name of a body");
      return it->second;
    };
    Joint joint;
    joint.name = value["name"].text();
    if (!names.insert(joint.name).second) value["name"].refuse("is that of another joint");
    joint.type = manifest::choose<Joint::Type>(value["type"], {{"revolute", Joint::Type::revolute},
                                                               {"continuous", Joint::Type::continuous},
                                                               {"prismatic", Joint::Type::prismatic}});
    joint.parent = value.has("parent") ? body("parent") : Joint::kWorld;
    joint.child = body("child");
    if (joint.parent == joint.child || held.count(joint.child) > 0) {
      value["child"].refuse("is held by another joint, or is a parent before it is a child");
    }
    if (!bodies[joint.child].is_dynamic) value["child"].refuse("has no mass, so a joint cannot move it");
    if (joint.parent != Joint::kWorld) held.insert(joint.parent);
    held.insert(joint.child);
    joint.pose = value.pose();
    joint.axis = value["axis"].vector(-2, 2);
    if (!(btFabs(joint.axis.length2() - 1) < btScalar(1e-3))) value["axis"].refuse("is not of unit length");
    joint.axis.normalize();
    if (value.has("lower")) {
      joint.lower = static_cast<btScalar>(value["lower"].number(-kFarthest, kFarthest));
      joint.upper = static_cast<btScalar>(value["upper"].number(double(joint.lower), kFarthest));
    }
    joints.push_back(std::move(joint));
  }
  return joints;
}

Multibodies make_multibodies(const std::vector<BodyParts>& bodies, const std::vector<Joint>& joints) {
  Multibodies made;
  for (const Tree& tree : grow_trees(joints)) {
    const BodyParts world;
    const BodyParts& base = tree.base == Joint::kWorld ? world : bodies[tree.base];
    const bool is_fixed = !base.is_dynamic;
    constexpr bool kMaySleep = false;
    made.bodies.push_back(std::make_unique<btMultiBody>(static_cast<int>(tree.joints.size()), base.mass, base.inertia,
                                                        is_fixed, kMaySleep));
    btMultiBody& multibody = *made.bodies.back();
    multibody.setBaseWorldTransform(base.pose * base.frame);
    multibody.setLinearDamping(0);
    multibody.setAngularDamping(0);
    multibody.setHasSelfCollision(true);
    std::map<std::size_t, int> link_of;  // by bodies
    if (tree.base != Joint::kWorld) link_of[tree.base] = -1;
    for (const Joint* const joint : tree.joints) {
      const int link = static_cast<int>(link_of.size()) - (tree.base != Joint::kWorld ? 1 : 0);
      const bool is_rooted = joint->parent == Joint::kWorld;
      set_up(multibody, link, is_rooted ? -1 : link_of[joint->parent],
             is_rooted ? btTransform::getIdentity() : bodies[joint->parent].frame, bodies[joint->child], *joint);
      link_of[joint->child] = link;
      made.joints[joint->name] = {&multibody, link};
      if (joint->lower <= joint->upper) {
        made.limits.push_back(
            std::make_unique<btMultiBodyJointLimitConstraint>(&multibody, link, joint->lower, joint->upper));
      }
    }
    multibody.finalizeMultiDof();
    if (!is_fixed) multibody.setBaseVel(base.velocity);
    for (const auto& [number, link] : link_of) {
      const BodyParts& body = bodies[number];
      if (body.shape == nullptr) continue;
      made.colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&multibody, link));
      btMultiBodyLinkCollider& collider = *made.colliders.back();
      made.collider_of[number] = &collider;
      collider.setCollisionShape(body.shape);
      collider.setFriction(body.friction);
      collider.setRestitution(body.restitution);
      if (link < 0) {
        multibody.setBaseCollider(&collider);
      } else {
        multibody.getLink(link).m_collider = &collider;
      }
    }
    btAlignedObjectArray<btQuaternion> rotations;
    btAlignedObjectArray<btVector3> origins;
    multibody.forwardKinematics(rotations, origins);
    multibody.updateCollisionObjectWorldTransforms(rotations, origins);
  }
  return made;
}

void Multibodies::add_to(btMultiBodyDynamicsWorld& world, const std::vector<BodyParts>& parts) {
  for (const auto& multibody : bodies) world.addMultiBody(multibody.get());
  for (const auto& [number, collider] : collider_of) {
    world.addCollisionObject(collider, parts[number].group, parts[number].mask);
  }
  for (const auto& limit : limits) world.addMultiBodyConstraint(limit.get());
}

void Multibodies::remove_from(btMultiBodyDynamicsWorld& world) {
  for (const auto& limit : limits) world.removeMultiBodyConstraint(limit.get());
  for (const auto& collider : colliders) world.removeCollisionObject(collider.get());
  for (const auto& multibody : bodies) world.removeMultiBody(multibody.get());
}

}  // namespace vps::bullet
