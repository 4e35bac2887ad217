// SPDX-License-Identifier: Zlib
// Fills Bullet's manifolds. The only file with Bullet's `depth`, which is negative when penetrating.
#include "runtime/bullet/manifolds.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <array>

namespace vps::bullet {
namespace {

// What a point of the last step hands over. Warm starting needs the impulses, and clearing the manifold loses them.
struct OldPoint {
  btVector3 on_shell;  // shell body's frame
  btScalar impulse, right_side, lateral_1, lateral_2;
  int age;  // [steps]
  bool is_given_away;
};

// The points of the last step, matched by their position on the shell.
struct OldPoints {
  std::array<OldPoint, MANIFOLD_CACHE_SIZE> points;
  int count = 0;

  OldPoints(const btPersistentManifold& manifold, bool shell_is_first) : count(manifold.getNumContacts()) {
    for (int i = 0; i < count; ++i) {
      const btManifoldPoint& p = manifold.getContactPoint(i);
      points[static_cast<std::size_t>(i)] = {shell_is_first ? p.m_localPointA : p.m_localPointB,
                                             p.m_appliedImpulse,
                                             p.m_prevRHS,
                                             p.m_appliedImpulseLateral1,
                                             p.m_appliedImpulseLateral2,
                                             p.m_lifeTime,
                                             false};
    }
  }

  // Copies the impulses of the nearest old point within `reach` to a fresh one. Each old point is used only once.
  void hand_over(btManifoldPoint& fresh, const btVector3& on_shell, btScalar reach) {
    OldPoint* nearest = nullptr;
    btScalar least = reach * reach;
    for (int i = 0; i < count; ++i) {
      OldPoint& candidate = points[static_cast<std::size_t>(i)];
      const btScalar distance = candidate.on_shell.distance2(on_shell);
      if (candidate.is_given_away || !(distance < least)) continue;
      least = distance;
      nearest = &candidate;
    }
    if (nearest == nullptr) return;
    fresh.m_appliedImpulse = nearest->impulse;
    fresh.m_prevRHS = nearest->right_side;
    fresh.m_appliedImpulseLateral1 = nearest->lateral_1;
    fresh.m_appliedImpulseLateral2 = nearest->lateral_2;
    fresh.m_lifeTime = nearest->age + 1;
    nearest->is_given_away = true;
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
  release();
}

void Manifolds::release_from(int slot) {
  for (int i = slot; i < manifolds_.size(); ++i) {
    if (manifolds_[i] != nullptr) dispatcher_->releaseManifold(manifolds_[i]);
  }
  if (slot < manifolds_.size()) manifolds_.resize(slot);
}
void Manifolds::clear() {
  for (int i = 0; i < filled_.size(); ++i) manifolds_[filled_[i]]->clearManifold();
  filled_.resize(0);
  release_from(1);
}
void Manifolds::append_to(btManifoldArray& all) const {
  for (int i = 0; i < manifolds_.size(); ++i) {
    if (manifolds_[i] != nullptr) all.push_back(manifolds_[i]);
  }
}

btPersistentManifold* Manifolds::manifold(int slot, const btManifoldResult* result, btScalar threshold) {
  if (manifolds_[slot] == nullptr) {
    manifolds_[slot] = dispatcher_->getNewManifold(result->getBody0Wrap()->getCollisionObject(),
                                                   result->getBody1Wrap()->getCollisionObject());
  }
  // Bullet accepts, merges and drops points by this distance. Its default grows with the bodies' size. With a whole
  // voxel, shallow points would replace the deepest.
  manifolds_[slot]->setContactBreakingThreshold(threshold);
  return manifolds_[slot];
}

void Manifolds::replace(const Pair& pair, std::span<const ManifoldContact> contacts, const Placing& placing,
                        btManifoldResult* result) {
  // Of hundreds of manifolds few have points: the others are not touched.
  auto next = contacts.begin();
  for (int i = 0; i < filled_.size(); ++i) {
    next = std::find_if(next, contacts.end(), [&](const ManifoldContact& c) { return c.slot >= filled_[i]; });
    const bool stays = next != contacts.end() && next->slot == filled_[i];
    if (!stays && filled_[i] < manifolds_.size()) manifolds_[filled_[i]]->clearManifold();
  }
  filled_.resize(0);
  // Once: Bullet's arrays grow to the size asked for, and copy each time.
  if (!contacts.empty() && manifolds_.size() <= contacts.back().slot)
    manifolds_.resize(contacts.back().slot + 1, nullptr);
  while (!contacts.empty()) {
    const int slot = contacts.front().slot;
    const auto end =
        std::find_if(contacts.begin(), contacts.end(), [=](const ManifoldContact& c) { return c.slot != slot; });
    const auto count = static_cast<std::size_t>(end - contacts.begin());
    fill(slot, pair, contacts.first(count), placing, result);
    filled_.push_back(slot);
    contacts = contacts.subspan(count);
  }
  const int last = filled_.size() > 0 ? filled_[filled_.size() - 1] : 0;
  release_from(last + 1);
}

void Manifolds::fill(int slot, const Pair& pair, std::span<const ManifoldContact> contacts, const Placing& placing,
                     btManifoldResult* result) {
  btPersistentManifold* const target = manifold(slot, result, btScalar(1.01) * btScalar(placing.reach));
  result->setPersistentManifold(target);
  // Normals follow the order of the manifold's bodies, not the order of the call.
  const bool shell_is_first = target->getBody0() == pair.shell.object;
  OldPoints old(*target, shell_is_first);
  target->clearManifold();

  for (const ManifoldContact& contact : contacts) {
    const btVector3 into_shell = placing.frame.getBasis() * to_bt(contact.inward_normal);
    const btVector3 position = placing.frame * to_bt(contact.position) - pair.shell.vps->getMargin() * into_shell;
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
    old.hand_over(fresh, shell_is_first ? fresh.m_localPointA : fresh.m_localPointB, btScalar(placing.beside));
  }
}

}  // namespace vps::bullet
