// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Bullet's dispatcher with the algorithms of GImpact and of the plug-in, which times every narrowphase.
#pragma once

#include <BulletCollision/Gimpact/btGImpactCollisionAlgorithm.h>
#include <btBulletCollisionCommon.h>

#include "cli/lab/pair.h"
#include "runtime/bullet/vps_bullet.h"

namespace vps::lab {

class TimedDispatcher final : public btCollisionDispatcher {
 public:
  explicit TimedDispatcher(btCollisionConfiguration* configuration) : btCollisionDispatcher(configuration) {
    btGImpactCollisionAlgorithm::registerAlgorithm(this);
    bullet::register_algorithm(*this);  // GImpact overwrites entries
  }
  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override {
    const auto begin = Clock::now();
    btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
    last_us = microseconds_since(begin);
  }
  /// Visits the contacts of all manifolds. @return their number
  template <class Visit>
  std::size_t for_each_contact(Visit visit) {
    std::size_t count = 0;
    for (int m = 0; m < getNumManifolds(); ++m) {
      const btPersistentManifold* const manifold = getManifoldByIndexInternal(m);
      for (int i = 0; i < manifold->getNumContacts(); ++i, ++count) visit(manifold->getContactPoint(i), *manifold);
    }
    return count;
  }
  double last_us = 0;  ///< of the last narrowphase of all pairs, until their manifolds were filled
};

}  // namespace vps::lab
