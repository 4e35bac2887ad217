// SPDX-License-Identifier: Zlib
// Fills Bullet's manifolds. The only file with Bullet's `depth`, which is negative when penetrating.
#include "runtime/bullet/manifolds.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <iterator>
#include <vector>

namespace vps::bullet {
// What a point of the last step hands over. Warm starting needs the impulses, and clearing the manifold loses them.
struct OldPoint {
  btVector3 on_shell;  // shell body's frame
  btScalar impulse, right_side, lateral_1, lateral_2;
  int age;  // [steps]
  bool is_given_away;
};

namespace {

// The points of a manifold in the last step.
struct OldPoints {
  std::array<OldPoint, MANIFOLD_CACHE_SIZE> points;
  int count = 0;

  OldPoints(const btPersistentManifold& manifold, const btCollisionObject* shell) : count(manifold.getNumContacts()) {
    const bool shell_is_first = manifold.getBody0() == shell;
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
  [[nodiscard]] std::span<OldPoint> all() { return {points.data(), static_cast<std::size_t>(count)}; }
};

// Old points that carried a load and have no manifold any more, or no place in it: a body that comes to rest changes
// from the contacts of segments to four.
void add_orphans(std::span<const OldPoint> old, std::vector<OldPoint>& orphans) {
  std::copy_if(old.begin(), old.end(), std::back_inserter(orphans),
               [](const OldPoint& p) { return !p.is_given_away && p.impulse > 0; });
}

// Copies the impulses of the nearest old point within `reach` to a fresh one. Each old point is used only once.
// @return whether there is one
bool hand_over(std::span<OldPoint> points, btManifoldPoint& fresh, const btVector3& on_shell, btScalar reach) {
  OldPoint* nearest = nullptr;
  btScalar least = reach * reach;
  for (OldPoint& candidate : points) {
    const btScalar distance = candidate.on_shell.distance2(on_shell);
    if (candidate.is_given_away || !(distance < least)) continue;
    least = distance;
    nearest = &candidate;
  }
  if (nearest == nullptr) return false;
  fresh.m_appliedImpulse = nearest->impulse;
  fresh.m_prevRHS = nearest->right_side;
  fresh.m_appliedImpulseLateral1 = nearest->lateral_1;
  fresh.m_appliedImpulseLateral2 = nearest->lateral_2;
  fresh.m_lifeTime = nearest->age + 1;
  nearest->is_given_away = true;
  return true;
}

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

Manifolds::Previous Manifolds::previous() const {
  Previous out;
  if (manifolds_.size() == 0 || manifolds_[0] == nullptr) return out;
  for (int i = 0; i < manifolds_[0]->getNumContacts(); ++i) {
    out.features[out.count++] = static_cast<std::uint32_t>(manifolds_[0]->getContactPoint(i).m_index0);
  }
  return out;
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

void Manifolds::replace(const Pair& pair, std::span<const ManifoldContact> contacts, const FoundContacts& found,
                        btManifoldResult* result) {
  thread_local std::vector<OldPoint> orphans;
  orphans.clear();
  // Of hundreds of manifolds few have points: the others are not touched.
  auto next = contacts.begin();
  for (int i = 0; i < filled_.size(); ++i) {
    next = std::find_if(next, contacts.end(), [&](const ManifoldContact& c) { return c.slot >= filled_[i]; });
    const bool stays = next != contacts.end() && next->slot == filled_[i];
    if (stays || filled_[i] >= manifolds_.size()) continue;
    add_orphans(OldPoints(*manifolds_[filled_[i]], pair.shell.object).all(), orphans);
    manifolds_[filled_[i]]->clearManifold();
  }
  filled_.resize(0);
  while (!contacts.empty()) {
    const int slot = contacts.front().slot;
    const auto end =
        std::find_if(contacts.begin(), contacts.end(), [=](const ManifoldContact& c) { return c.slot != slot; });
    const auto count = static_cast<std::size_t>(end - contacts.begin());
    fill(slot, pair, contacts.first(count), found, orphans, result);
    filled_.push_back(slot);
    contacts = contacts.subspan(count);
  }
  const int last = filled_.size() > 0 ? filled_[filled_.size() - 1] : 0;
  release_from(last + 1);
}

void Manifolds::fill(int slot, const Pair& pair, std::span<const ManifoldContact> contacts, const FoundContacts& found,
                     std::vector<OldPoint>& orphans, btManifoldResult* result) {
  btPersistentManifold* const target = manifold(slot, result, btScalar(1.01) * btScalar(found.reach));
  result->setPersistentManifold(target);
  // Normals follow the order of the manifold's bodies, not the order of the call.
  const bool shell_is_first = target->getBody0() == pair.shell.object;
  OldPoints old(*target, pair.shell.object);
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
    const btVector3& on_shell = shell_is_first ? fresh.m_localPointA : fresh.m_localPointB;
    if (!hand_over(old.all(), fresh, on_shell, beside(pair))) (void)hand_over(orphans, fresh, on_shell, beside(pair));
  }
  add_orphans(old.all(), orphans);
}

}  // namespace vps::bullet
