// SPDX-License-Identifier: Zlib
// Fills Bullet's manifolds. The only file with Bullet's `depth`, which is negative when penetrating.
#include "runtime/bullet/manifolds.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace vps::bullet {
namespace {

// Points of the last step with their impulses, matched by their position on the shell. Warm starting needs the
// impulses, and clearing the manifold loses them.
struct OldPoint {
  btVector3 on_shell;  // shell body's frame
  btManifoldPoint point;
};

struct OldPoints {
  std::array<OldPoint, MANIFOLD_CACHE_SIZE> points;
  int count = 0;

  OldPoints(const btPersistentManifold& manifold, bool shell_is_first) : count(manifold.getNumContacts()) {
    for (int i = 0; i < count; ++i) {
      const btManifoldPoint& p = manifold.getContactPoint(i);
      points[static_cast<std::size_t>(i)] = {shell_is_first ? p.m_localPointA : p.m_localPointB, p};
    }
  }

  // Copies the impulses of the nearest old point within `reach` to a fresh one. Each old point is used only once.
  void hand_over(btManifoldPoint& fresh, const btVector3& on_shell, btScalar reach) {
    OldPoint* nearest = nullptr;
    btScalar least = reach * reach;
    for (int i = 0; i < count; ++i) {
      OldPoint& candidate = points[static_cast<std::size_t>(i)];
      const btScalar distance = candidate.on_shell.distance2(on_shell);
      if (candidate.point.m_lifeTime < 0 || !(distance < least)) continue;
      least = distance;
      nearest = &candidate;
    }
    if (nearest == nullptr) return;
    fresh.m_appliedImpulse = nearest->point.m_appliedImpulse;
    fresh.m_prevRHS = nearest->point.m_prevRHS;
    fresh.m_appliedImpulseLateral1 = nearest->point.m_appliedImpulseLateral1;
    fresh.m_appliedImpulseLateral2 = nearest->point.m_appliedImpulseLateral2;
    fresh.m_lifeTime = nearest->point.m_lifeTime + 1;
    nearest->point.m_lifeTime = -1;  // given away
  }
};

// Bullet clears these values in every addContactPoint. They are weighted by area, so that the stiffness does not depend
// on the sampling.
void make_spring(btManifoldPoint& fresh, const PenaltyLaw& law, std::span<const ManifoldContact> contacts) {
  for (const ManifoldContact& contact : contacts) {
    if (static_cast<int>(contact.feature) != fresh.m_index0) continue;
    fresh.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
    fresh.m_combinedContactStiffness1 = static_cast<btScalar>(law.stiffness * double{contact.area});
    fresh.m_combinedContactDamping1 = static_cast<btScalar>(law.damping * double{contact.area});
  }
}

}  // namespace

Manifolds::~Manifolds() {
  release_from(0);
}

Manifolds::Previous Manifolds::previous() const {
  Previous out;
  if (manifolds_.size() == 0 || manifolds_[0] == nullptr) return out;
  for (int i = 0; i < manifolds_[0]->getNumContacts(); ++i) {
    out.features[out.count++] = static_cast<std::uint32_t>(manifolds_[0]->getContactPoint(i).m_index0);
  }
  return out;
}

void Manifolds::clear(int slot) {
  if (slot < manifolds_.size() && manifolds_[slot] != nullptr) manifolds_[slot]->clearManifold();
}
void Manifolds::release_from(int slot) {
  for (int i = slot; i < manifolds_.size(); ++i) {
    if (manifolds_[i] != nullptr) dispatcher_->releaseManifold(manifolds_[i]);
  }
  if (slot < manifolds_.size()) manifolds_.resize(slot);
}
void Manifolds::append_to(btManifoldArray& all) const {
  for (int i = 0; i < manifolds_.size(); ++i) {
    if (manifolds_[i] != nullptr) all.push_back(manifolds_[i]);
  }
}

btPersistentManifold* Manifolds::manifold(int slot, const btManifoldResult* result, btScalar threshold) {
  if (manifolds_.size() <= slot) manifolds_.resize(slot + 1, nullptr);
  if (manifolds_[slot] == nullptr) {
    manifolds_[slot] = dispatcher_->getNewManifold(result->getBody0Wrap()->getCollisionObject(),
                                                   result->getBody1Wrap()->getCollisionObject());
  }
  // Bullet accepts, merges and drops points by this distance. Its default grows with the bodies' size. With a whole
  // voxel, shallow points would replace the deepest.
  manifolds_[slot]->setContactBreakingThreshold(threshold);
  return manifolds_[slot];
}

void Manifolds::fill(int slot, const Pair& pair, std::span<const ManifoldContact> contacts, const FoundContacts& found,
                     btManifoldResult* result) {
  const bool exists = slot < manifolds_.size() && manifolds_[slot] != nullptr;
  if (contacts.empty() && !exists) return;
  btPersistentManifold* const target = manifold(slot, result, btScalar(1.01) * btScalar(found.reach));
  result->setPersistentManifold(target);
  // Normals follow the order of the manifold's bodies, not the order of the call.
  const bool shell_is_first = target->getBody0() == pair.shell.object;
  OldPoints old(*target, shell_is_first);
  target->clearManifold();

  for (const ManifoldContact& contact : contacts) {
    const btVector3 into_shell = found.frame.getBasis() * to_bt(contact.inward_normal);
    const btVector3 position = found.frame * to_bt(contact.position) - pair.shell.vps->getMargin() * into_shell;
    const btScalar depth = -btScalar(contact.penetration);
    // Bullet wants the normal on the second body towards the first, and the point on the second.
    const btVector3 normal = shell_is_first ? into_shell : -into_shell;
    const btVector3 point_on_second = shell_is_first ? position - depth * normal : position;
    const int id = static_cast<int>(contact.feature);
    result->setShapeIdentifiersA(0, id);
    result->setShapeIdentifiersB(0, id);
    result->addContactPoint(normal, point_on_second, depth);
  }
  const bool has_springs = foundation_of(pair).stiffness > 0 && pair.shell.vps->segment_level() == 0;
  // A result that only reports (contactTest) leaves the manifold empty.
  for (int i = 0; i < target->getNumContacts(); ++i) {
    btManifoldPoint& fresh = target->getContactPoint(i);
    if (has_springs) make_spring(fresh, foundation_of(pair), contacts);
    old.hand_over(fresh, shell_is_first ? fresh.m_localPointA : fresh.m_localPointB, beside(pair));
  }
}

}  // namespace vps::bullet
