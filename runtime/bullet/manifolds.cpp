// SPDX-License-Identifier: Zlib
// Fills Bullet's manifolds. The only file with Bullet's `depth`, which is negative when penetrating.
#include "runtime/bullet/manifolds.h"

#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <typeinfo>
#include <utility>

namespace vps::bullet {
namespace {

constexpr btScalar kBreaking = btScalar(1.01);  // of a manifold's threshold: of the largest distance of a contact

// The feature of a contact's point is its part in both bodies. Its index is the child of a compound, as Bullet's own.
int feature_of(const btManifoldPoint& point) {
  return point.m_partId0;
}

// What a point of the last step hands over. Warm starting needs the impulses, and clearing the manifold loses them.
struct OldPoint {
  btVector3 on_shell;  // shell body's frame
  btScalar impulse, right_side, lateral_1, lateral_2;
  int age;          // [steps]
  void* user_data;  // null: none, or handed over
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
                                             p.m_userPersistentData,
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
    // A callback that found none may have made some, which is not needed.
    if (nearest->user_data != nullptr) std::swap(fresh.m_userPersistentData, nearest->user_data);
    nearest->is_given_away = true;
  }
  void forget_user_data() {
    for (OldPoint& point : points) point.user_data = nullptr;
  }
  // As Bullet does where it removes a point.
  void destroy_user_data() const {
    if (gContactDestroyedCallback == nullptr) return;
    for (int i = 0; i < count; ++i) {
      if (void* const data = points[static_cast<std::size_t>(i)].user_data) gContactDestroyedCallback(data);
    }
  }
};

bool has_springs(const Pair& pair) {
  return foundation_of(pair).stiffness > 0 && pair.shell.vps->segment_level() == 0;
}

// Bullet clears these values in every addContactPoint. They are weighted by area, so that the stiffness does not depend
// on the sampling.
void make_spring(btManifoldPoint& fresh, const PenaltyLaw& law, std::span<const ManifoldContact> contacts) {
  for (const ManifoldContact& contact : contacts) {
    if (static_cast<int>(contact.feature) != feature_of(fresh)) continue;
    fresh.m_contactPointFlags |= BT_CONTACT_FLAG_CONTACT_STIFFNESS_DAMPING;
    fresh.m_combinedContactStiffness1 = static_cast<btScalar>(law.stiffness * double{contact.area});
    fresh.m_combinedContactDamping1 = static_cast<btScalar>(law.damping * double{contact.area});
  }
}

// As addContactPoint wants it.
struct FreshPoint {
  btVector3 normal, on_second;
  btScalar depth;
};

// Puts the points of contacts in the contacts' order, before all others. @return how many there are
int put_in_order(btPersistentManifold& manifold, std::span<const ManifoldContact> contacts) {
  int next = 0;
  for (const ManifoldContact& contact : contacts) {
    int at = next;
    while (at < manifold.getNumContacts() && feature_of(manifold.getContactPoint(at)) != int(contact.feature)) ++at;
    if (at == manifold.getNumContacts()) continue;
    if (at != next) std::swap(manifold.getContactPoint(next), manifold.getContactPoint(at));
    ++next;
  }
  return next;
}

// Whether a manifold has points of the same contacts. If so, puts them in their order.
bool are_the_same(btPersistentManifold& manifold, std::span<const ManifoldContact> contacts) {
  const int count = manifold.getNumContacts();
  return count == static_cast<int>(contacts.size()) && put_in_order(manifold, contacts) == count;
}

// Whether a result is Bullet's own, not one of a test that reports points.
bool is_bullets_own(const btManifoldResult& result) {
  return typeid(result) == typeid(btManifoldResult);
}
bool has_flag(const btManifoldResult& result, int flags) {
  return ((result.getBody0Internal()->getCollisionFlags() | result.getBody1Internal()->getCollisionFlags()) & flags) !=
         0;
}

// The user may change a point that was added or moved, as in addContactPoint.
void call_added_callback(const btManifoldResult& result, const btPersistentManifold& manifold, btManifoldPoint& p) {
  const btCollisionObjectWrapper* first = result.getBody0Wrap();
  const btCollisionObjectWrapper* second = result.getBody1Wrap();
  if (manifold.getBody0() != first->getCollisionObject()) std::swap(first, second);
  gContactAddedCallback(p, first, p.m_partId0, p.m_index0, second, p.m_partId1, p.m_index1);
}

// Empties a manifold but for a placeholder, which the first fresh point replaces. So Bullet does not report that the
// contact ended and another one started. OldPoints has the user's data.
void keep_placeholder(const FreshPoint& fresh, btPersistentManifold& manifold) {
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    manifold.getContactPoint(i).m_userPersistentData = nullptr;
  }
  manifold.setNumContacts(1);
  btManifoldPoint& p = manifold.getContactPoint(0);
  p = btManifoldPoint();
  p.m_localPointA = manifold.getBody0()->getWorldTransform().invXform(fresh.on_second + fresh.normal * fresh.depth);
}

// Moves the points of a manifold, which keep their impulses: what clearing it and adding them again comes to.
// @return false if one has moved too far
bool move_points(std::span<const FreshPoint> fresh, bool shell_is_first, btScalar beside,
                 const btManifoldResult& result, btPersistentManifold& manifold) {
  const btCollisionObject& a = *manifold.getBody0();
  const btCollisionObject& b = *manifold.getBody1();
  std::array<btVector3, MANIFOLD_CACHE_SIZE> local_a;
  std::array<btVector3, MANIFOLD_CACHE_SIZE> local_b;
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    if (fresh[i].depth > manifold.getContactBreakingThreshold()) return false;
    local_a[i] = a.getWorldTransform().invXform(fresh[i].on_second + fresh[i].normal * fresh[i].depth);
    local_b[i] = b.getWorldTransform().invXform(fresh[i].on_second);
    const btManifoldPoint& p = manifold.getContactPoint(static_cast<int>(i));
    const btScalar moved =
        shell_is_first ? p.m_localPointA.distance2(local_a[i]) : p.m_localPointB.distance2(local_b[i]);
    if (!(moved < beside * beside)) return false;
  }
  // These may be the user's own.
  const btCollisionObject* const first = result.getBody0Internal();
  const btCollisionObject* const second = result.getBody1Internal();
  const btScalar friction = gCalculateCombinedFrictionCallback(first, second);
  const btScalar restitution = gCalculateCombinedRestitutionCallback(first, second);
  const btScalar rolling = gCalculateCombinedRollingFrictionCallback(first, second);
  const btScalar spinning = gCalculateCombinedSpinningFrictionCallback(first, second);
  btVector3 along;
  btVector3 across;
  for (std::size_t i = 0; i < fresh.size(); ++i) {
    btManifoldPoint& p = manifold.getContactPoint(static_cast<int>(i));
    p.m_localPointA = local_a[i];
    p.m_localPointB = local_b[i];
    p.m_positionWorldOnB = fresh[i].on_second;
    p.m_positionWorldOnA = fresh[i].on_second + fresh[i].normal * fresh[i].depth;
    p.m_normalWorldOnB = fresh[i].normal;
    p.m_distance1 = fresh[i].depth;
    if (i == 0 || !(fresh[i].normal == fresh[i - 1].normal)) btPlaneSpace1(fresh[i].normal, along, across);
    p.m_lateralFrictionDir1 = along;
    p.m_lateralFrictionDir2 = across;
    p.m_combinedFriction = friction;
    p.m_combinedRestitution = restitution;
    p.m_combinedRollingFriction = rolling;
    p.m_combinedSpinningFriction = spinning;
    p.m_contactPointFlags = 0;
    ++p.m_lifeTime;
  }
  if (gContactAddedCallback != nullptr && has_flag(result, btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK)) {
    for (int i = 0; i < manifold.getNumContacts(); ++i)
      call_added_callback(result, manifold, manifold.getContactPoint(i));
  }
  return true;
}

using Order = std::array<std::size_t, MANIFOLD_CACHE_SIZE>;

// The order in which points are added. Bullet accepts points by the threshold within which it merges them. With
// contacts ahead it is as long as the way of a step: a shallow corner would take the place of a deep one below it. So
// the deepest comes last.
Order order_of(std::span<const FreshPoint> fresh, const Placing& placing) {
  Order order{};
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (placing.reach > placing.touching) {
    std::stable_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(fresh.size()),
                     [&](std::size_t i, std::size_t k) { return fresh[i].depth > fresh[k].depth; });
  }
  return order;
}

// Adds a point. It is merged only with those that are closer than its own distance.
void add_point(const ManifoldContact& contact, const FreshPoint& fresh, const Placing& placing,
               btManifoldResult& result, btPersistentManifold& manifold) {
  const int feature = static_cast<int>(contact.feature);
  result.setShapeIdentifiersA(feature, result.getBody0Wrap()->m_index);
  result.setShapeIdentifiersB(feature, result.getBody1Wrap()->m_index);
  const btScalar threshold = manifold.getContactBreakingThreshold();
  const btScalar least = kBreaking * btScalar(placing.touching);
  manifold.setContactBreakingThreshold(std::min(std::max(kBreaking * fresh.depth, least), threshold));
  // Else Bullet keeps the point that is there, where bodies have friction anchors.
  for (int i = 0; i < manifold.getNumContacts(); ++i) manifold.getContactPoint(i).m_appliedImpulseLateral1 = 1;
  result.addContactPoint(fresh.normal, fresh.on_second, fresh.depth);
  manifold.setContactBreakingThreshold(threshold);
}

// Adds the points anew, with the impulses of old ones nearby.
void add_points(const Pair& pair, std::span<const ManifoldContact> contacts, std::span<const FreshPoint> fresh,
                const Placing& placing, btManifoldResult& result, btPersistentManifold& manifold) {
  const bool shell_is_first = manifold.getBody0() == pair.shell.object;
  OldPoints old(manifold, shell_is_first);
  const Order order = order_of(fresh, placing);
  const std::span<const std::size_t> all(order.data(), fresh.size());
  // Those that moved beyond the threshold Bullet does not take.
  const auto first = std::find_if(
      all.begin(), all.end(), [&](std::size_t i) { return fresh[i].depth <= manifold.getContactBreakingThreshold(); });
  if (old.count > 0 && is_bullets_own(result) && first != all.end()) {
    keep_placeholder(fresh[*first], manifold);
  } else {
    manifold.clearManifold();
    old.forget_user_data();
  }
  for (const std::size_t i : all) add_point(contacts[i], fresh[i], placing, result, manifold);
  (void)put_in_order(manifold, contacts);
  // A result that only reports (contactTest) leaves the manifold empty.
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    btManifoldPoint& point = manifold.getContactPoint(i);
    point.m_appliedImpulseLateral1 = 0;
    if (has_springs(pair)) make_spring(point, foundation_of(pair), contacts);
    old.hand_over(point, shell_is_first ? point.m_localPointA : point.m_localPointB, btScalar(placing.beside));
  }
  old.destroy_user_data();
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
  btPersistentManifold* const target = manifold(slot, result, kBreaking * btScalar(placing.reach));
  result->setPersistentManifold(target);
  // Normals follow the order of the manifold's bodies, not the order of the call.
  const bool shell_is_first = target->getBody0() == pair.shell.object;
  const auto point_of = [&](const ManifoldContact& contact) {
    const btVector3 into_shell = placing.frame.getBasis() * to_bt(contact.inward_normal);
    const btVector3 position = placing.frame * to_bt(contact.position) - pair.shell.vps->getMargin() * into_shell;
    const btScalar depth = -btScalar(contact.penetration);
    // Bullet wants the normal on the second body towards the first, and the point on the second.
    const btVector3 normal = shell_is_first ? into_shell : -into_shell;
    return FreshPoint{normal, shell_is_first ? position - depth * normal : position, depth};
  };
  std::array<FreshPoint, MANIFOLD_CACHE_SIZE> fresh;
  std::transform(contacts.begin(), contacts.end(), fresh.begin(), point_of);
  const std::span<const FreshPoint> all(fresh.data(), contacts.size());
  constexpr int kChangesPoints =
      btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING | btCollisionObject::CF_HAS_FRICTION_ANCHOR;
  const bool moves = !has_springs(pair) && are_the_same(*target, contacts) && is_bullets_own(*result) &&
                     !has_flag(*result, kChangesPoints) &&
                     move_points(all, shell_is_first, btScalar(placing.beside), *result, *target);
  if (!moves) add_points(pair, contacts, all, placing, *result, *target);
  for (int i = 0; gContactProcessedCallback != nullptr && i < target->getNumContacts(); ++i) {
    gContactProcessedCallback(target->getContactPoint(i), const_cast<btCollisionObject*>(target->getBody0()),
                              const_cast<btCollisionObject*>(target->getBody1()));
  }
}

}  // namespace vps::bullet
