// SPDX-License-Identifier: Zlib
// The collision algorithm that Bullet's dispatcher calls for each pair with a Shape. Paper: Secs. 2.4 and 3.2.
// The only file that speaks Bullet's `depth`: negative when penetrating.
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionCreateFunc.h>
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <memory>

#include "runtime/bullet/reduce_contacts.h"
#include "runtime/bullet/vps_bullet.h"
#include "runtime/penetration.h"

namespace vps::bullet {
namespace {

// Working memory of a thread: pairs may run in parallel, assets are immutable.
struct Workspace {
  Scratch scratch;
  std::vector<Contact> contacts;
};
Workspace& workspace(const PointshellView& shell) {
  thread_local Workspace space;
  if (space.contacts.size() < shell.points) space.contacts.resize(shell.points);
  return space;
}

const Shape* as_vps(const btCollisionObjectWrapper* wrap) {
  return wrap->getCollisionShape()->getShapeType() == kProxyType ? dynamic_cast<const Shape*>(wrap->getCollisionShape())
                                                                 : nullptr;
}

// World pose of a frame whose origin lies at `origin` in the shape's own frame. The wrapper's transform is the only one
// that is right for children of compounds.
Pose pose_of(const btCollisionObjectWrapper* wrap, const btVector3& origin) {
  const btTransform& world = wrap->getWorldTransform();
  const btVector3 moved = world.getBasis() * origin;
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = static_cast<double>(world.getBasis()[i][j]);
    pose.translation[i] = static_cast<double>(world.getOrigin()[i]) + static_cast<double>(moved[i]);
  }
  return pose;
}

// Who plays what in a pair.
struct Roles {
  const btCollisionObjectWrapper* shell_wrap = nullptr;
  const btCollisionObjectWrapper* field_wrap = nullptr;
  const Shape* shell = nullptr;
  const Shape* map = nullptr;  ///< null for analytic partners
};

Roles assign_roles(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second) {
  const Shape* const a = as_vps(first);
  const Shape* const b = as_vps(second);
  if (b == nullptr) return {first, second, a, nullptr};
  if (a == nullptr) return {second, first, b, nullptr};
  // Where neither can, the query says so.
  ShellRole role{};
  (void)choose_roles(a->asset(), b->asset(), role);
  return role == ShellRole::first ? Roles{first, second, a, b} : Roles{second, first, b, a};
}

Vec3 to_vec3(const btVector3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

// At edges and corners the shell's normal is an average of its faces': as a contact normal it pushes sideways, and in
// Eq. (4), by which layers answer, it misjudges the depth. The map's own normal serves both better; the shell's is left
// where the map has none.
Contact refined(const Shape& map, Contact contact) {
  const Vec3 outward = outward_normal(map.voxelmap(), contact.position);
  if (detail::dot(outward, outward) > 0) {
    contact.inward_normal = outward;
    contact.penetration = penetration(map.voxelmap(), contact.position, outward);
  }
  return contact;
}

// Impulses of the last step, found again by where on the shell they acted: warm starting needs them, clearing loses
// them.
struct OldPoint {
  btVector3 on_shell;  // shell body's frame
  btManifoldPoint point;
};

// Shell points of the last step's regular manifold.
struct Previous {
  std::array<std::uint32_t, MANIFOLD_CACHE_SIZE> points{};
  std::size_t count = 0;
  operator std::span<const std::uint32_t>() const { return {points.data(), count}; }
};

class ContactAlgorithm final : public btCollisionAlgorithm {
 public:
  explicit ContactAlgorithm(const btCollisionAlgorithmConstructionInfo& info) : btCollisionAlgorithm(info) {}
  ~ContactAlgorithm() override {
    for (int i = 0; i < manifolds_.size(); ++i) {
      if (manifolds_[i] != nullptr) m_dispatcher->releaseManifold(manifolds_[i]);
    }
  }

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    for (int i = 0; i < manifolds_.size(); ++i) {
      if (manifolds_[i] != nullptr) manifolds.push_back(manifolds_[i]);
    }
  }

 private:
  [[nodiscard]] Status query(const Roles& roles, const QueryOptions& options, Workspace& space,
                             QueryResult& found) const;
  void fill_manifold(int slot, const Roles& roles, std::span<const Contact> contacts, btManifoldResult* result);
  void clear_from(int slot);
  [[nodiscard]] Previous previous() const;
  btPersistentManifold* manifold(int slot, const btManifoldResult* result, btScalar threshold);

  // Slot 0 for regular contacts; one per segment otherwise, made when first needed. Null where none was needed.
  btAlignedObjectArray<btPersistentManifold*> manifolds_;
  const std::unique_ptr<ContactCache> cache_ = std::make_unique<ContactCache>();
};
// Algorithms live in a pool of fixed elements, and release builds of Bullet do not check.
static_assert(sizeof(ContactAlgorithm) <= 192);

// Bullet's breaking threshold for a pair: the coarser of the two voxel sizes.
btScalar breaking_threshold(const Roles& roles) {
  const double shell = roles.shell->asset().info().voxel_size;
  const double map = roles.map != nullptr ? roles.map->asset().info().voxel_size : shell;
  return static_cast<btScalar>(std::max(shell, map));
}

// Points up to this part of a voxel off the surface are contacts, so that a resting contact lives through the noise of
// a step. With a whole voxel a bunny on a box tests five times the points, and its flickering manifold never comes to
// rest.
constexpr btScalar kContactDistance_vx = btScalar(0.1);

// Depths of a flat contact differ by the rounding of the samples, which is a fiftieth of a voxel.
constexpr btScalar kAlikeDepth_vx = btScalar(0.02);

void ContactAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                        const btDispatcherInfo&, btManifoldResult* result) {
  if (as_vps(first) == nullptr && as_vps(second) == nullptr) return;  // another shape of the same type slot
  const Roles roles = assign_roles(first, second);
  Workspace& space = workspace(roles.shell->pointshell());
  QueryOptions options;
  options.contact_distance = static_cast<float>(
      std::max(kContactDistance_vx * breaking_threshold(roles), result->m_closestPointDistanceThreshold));
  options.segment_level = roles.shell->segment_level();
  options.cache = cache_.get();
  QueryResult found;
  if (const Status status = query(roles, options, space, found); status != Status::ok) {
    roles.shell->report(status);
    if (roles.map != nullptr) roles.map->report(status);
    clear_from(0);
    return;
  }
  const std::span<const Contact> contacts(space.contacts.data(), found.contacts);
  if (options.segment_level == 0) {
    std::array<std::uint32_t, 4> chosen{};
    const auto alike = static_cast<float>(kAlikeDepth_vx * breaking_threshold(roles));
    const std::size_t count = reduce_contacts(contacts, previous(), alike, chosen);
    std::array<Contact, 4> few;
    for (std::size_t i = 0; i < count; ++i) few[i] = contacts[chosen[i]];
    fill_manifold(0, roles, {few.data(), count}, result);
    clear_from(1);
    return;
  }
  // Sec. 2.4: a manifold per segment, always the same one for the same segment.
  const std::uint32_t base = roles.shell->pointshell().level_offsets[options.segment_level - 1];
  int next = 0;
  for (const Contact& contact : contacts) {
    const int slot = static_cast<int>(contact.node - base);
    for (; next < slot; ++next) {
      if (next < manifolds_.size() && manifolds_[next] != nullptr) manifolds_[next]->clearManifold();
    }
    fill_manifold(slot, roles, {&contact, 1}, result);
    next = slot + 1;
  }
  clear_from(next);
}

Status ContactAlgorithm::query(const Roles& roles, const QueryOptions& options, Workspace& space,
                               QueryResult& found) const {
  const PointshellView& shell = roles.shell->pointshell();
  const Pose shell_pose = pose_of(roles.shell_wrap, -roles.shell->centre_of_mass());
  const btVector3 field_origin = roles.map != nullptr ? -roles.map->centre_of_mass() : btVector3(0, 0, 0);
  const Pose pose = relative_pose(pose_of(roles.field_wrap, field_origin), shell_pose);
  if (roles.map != nullptr) {
    return traverse(shell, roles.map->voxelmap(), pose, options, space.scratch, space.contacts, found);
  }
  const btCollisionShape* const partner = roles.field_wrap->getCollisionShape();
  const std::span<Contact> contacts(space.contacts);
  // Contacts against analytic partners take the partner's normal, which is exact.
  const auto with_normals = [&](Status status, auto normal) {
    for (std::uint32_t i = 0; status == Status::ok && i < found.contacts; ++i) {
      contacts[i].inward_normal = normal(contacts[i].position);
    }
    return status;
  };
  switch (partner->getShapeType()) {
    case BOX_SHAPE_PROXYTYPE: {
      const BoxField box{to_vec3(static_cast<const btBoxShape*>(partner)->getHalfExtentsWithMargin())};
      return with_normals(traverse(shell, box, pose, options, space.scratch, contacts, found),
                          [&](Vec3 p) { return outward_normal(box, p); });
    }
    case SPHERE_SHAPE_PROXYTYPE: {
      const SphereField sphere{static_cast<float>(static_cast<const btSphereShape*>(partner)->getRadius())};
      return with_normals(traverse(shell, sphere, pose, options, space.scratch, contacts, found),
                          [&](Vec3 p) { return outward_normal(sphere, p); });
    }
    case STATIC_PLANE_PROXYTYPE: {
      const auto* plane = static_cast<const btStaticPlaneShape*>(partner);
      const HalfSpaceField half{to_vec3(plane->getPlaneNormal()), static_cast<float>(plane->getPlaneConstant())};
      return with_normals(traverse(shell, half, pose, options, space.scratch, contacts, found),
                          [&](Vec3) { return half.outward_normal; });
    }
    default:
      return Status::bad_argument;
  }
}

btPersistentManifold* ContactAlgorithm::manifold(int slot, const btManifoldResult* result, btScalar threshold) {
  if (manifolds_.size() <= slot) manifolds_.resize(slot + 1, nullptr);
  if (manifolds_[slot] == nullptr) {
    manifolds_[slot] = m_dispatcher->getNewManifold(result->getBody0Wrap()->getCollisionObject(),
                                                    result->getBody1Wrap()->getCollisionObject());
    // Bullet's default grows with the bodies; ours is a voxel. It is the accept, merge and drop distance at once.
    manifolds_[slot]->setContactBreakingThreshold(threshold);
  }
  return manifolds_[slot];
}

void ContactAlgorithm::clear_from(int slot) {
  for (int i = slot; i < manifolds_.size(); ++i) {
    if (manifolds_[i] != nullptr) manifolds_[i]->clearManifold();
  }
}

Previous ContactAlgorithm::previous() const {
  Previous out;
  if (manifolds_.size() == 0 || manifolds_[0] == nullptr) return out;
  for (int i = 0; i < manifolds_[0]->getNumContacts(); ++i) {
    out.points[out.count++] = static_cast<std::uint32_t>(manifolds_[0]->getContactPoint(i).m_index0);
  }
  return out;
}

// Replaces a manifold's points by fresh ones: refreshing would keep the normals of the step they were made in.
void ContactAlgorithm::fill_manifold(int slot, const Roles& roles, std::span<const Contact> contacts,
                                     btManifoldResult* result) {
  const bool exists = slot < manifolds_.size() && manifolds_[slot] != nullptr;
  if (contacts.empty() && !exists) return;
  const btScalar threshold = breaking_threshold(roles);
  btPersistentManifold* const target = manifold(slot, result, threshold);
  result->setPersistentManifold(target);
  // Normals follow the bodies of the manifold, whatever the order of the call.
  const bool shell_is_first = target->getBody0() == roles.shell_wrap->getCollisionObject();

  std::array<OldPoint, MANIFOLD_CACHE_SIZE> old;
  const int old_count = target->getNumContacts();
  for (int i = 0; i < old_count; ++i) {
    const btManifoldPoint& p = target->getContactPoint(i);
    old[static_cast<std::size_t>(i)] = {shell_is_first ? p.m_localPointA : p.m_localPointB, p};
  }
  target->clearManifold();

  const btVector3 field_origin = roles.map != nullptr ? -roles.map->centre_of_mass() : btVector3(0, 0, 0);
  const btTransform& world = roles.field_wrap->getWorldTransform();
  for (const Contact& raw : contacts) {
    const Contact contact = roles.map != nullptr ? refined(*roles.map, raw) : raw;
    const btVector3 position =
        world * (btVector3(contact.position.x, contact.position.y, contact.position.z) + field_origin);
    const btVector3 into_shell =
        world.getBasis() * btVector3(contact.inward_normal.x, contact.inward_normal.y, contact.inward_normal.z);
    const btScalar depth = -btScalar(contact.penetration);
    // Bullet wants the normal on the second body towards the first, and the point on the second.
    const btVector3 normal = shell_is_first ? into_shell : -into_shell;
    const btVector3 point_on_second = shell_is_first ? position - depth * normal : position;
    const int id = static_cast<int>(contact.point);
    result->setShapeIdentifiersA(0, id);
    result->setShapeIdentifiersB(0, id);
    result->addContactPoint(normal, point_on_second, depth);
  }
  // A result that only reports (contactTest) leaves the manifold empty.
  for (int i = 0; i < target->getNumContacts(); ++i) {
    btManifoldPoint& fresh = target->getContactPoint(i);
    const btVector3& on_shell = shell_is_first ? fresh.m_localPointA : fresh.m_localPointB;
    OldPoint* nearest = nullptr;
    btScalar reach = 4 * threshold * threshold;
    for (int k = 0; k < old_count; ++k) {
      OldPoint& candidate = old[static_cast<std::size_t>(k)];
      const btScalar distance = candidate.on_shell.distance2(on_shell);
      if (candidate.point.m_lifeTime >= 0 && distance < reach) {
        reach = distance;
        nearest = &candidate;
      }
    }
    if (nearest == nullptr) continue;
    fresh.m_appliedImpulse = nearest->point.m_appliedImpulse;
    fresh.m_prevRHS = nearest->point.m_prevRHS;
    fresh.m_appliedImpulseLateral1 = nearest->point.m_appliedImpulseLateral1;
    fresh.m_appliedImpulseLateral2 = nearest->point.m_appliedImpulseLateral2;
    fresh.m_lifeTime = nearest->point.m_lifeTime + 1;
    nearest->point.m_lifeTime = -1;  // given away
  }
}

struct CreateContactAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper*,
                                                 const btCollisionObjectWrapper*) override {
    void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(ContactAlgorithm));
    return new (memory) ContactAlgorithm(info);
  }
};

}  // namespace

void register_algorithm(btCollisionDispatcher& dispatcher) {
  // Without state, so one serves every dispatcher and outlives them all. The algorithm tells the bodies' roles by their
  // shapes: it needs no swapped twin.
  static CreateContactAlgorithm create;
  for (const int partner :
       {kProxyType, int{BOX_SHAPE_PROXYTYPE}, int{SPHERE_SHAPE_PROXYTYPE}, int{STATIC_PLANE_PROXYTYPE}}) {
    dispatcher.registerCollisionCreateFunc(kProxyType, partner, &create);
    dispatcher.registerCollisionCreateFunc(partner, kProxyType, &create);
    dispatcher.registerClosestPointsCreateFunc(kProxyType, partner, &create);
    dispatcher.registerClosestPointsCreateFunc(partner, kProxyType, &create);
  }
}

}  // namespace vps::bullet
