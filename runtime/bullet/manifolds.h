// SPDX-License-Identifier: Zlib
/// @file The contact manifolds of a pair: moved or filled anew each step, impulses carried over. Internal. Paper:
/// Sec. 3.2.
#pragma once

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include "runtime/bullet/pair.h"
#include "runtime/contacts/manifold_contact.h"

namespace vps::bullet {

using detail::ManifoldContact;

/// Where contacts are.
struct Placing {
  btTransform frame;  ///< takes their frame to the world
  float reach;        ///< their largest distance off the surface. [m]
  float touching;     ///< the same of those that are not ahead. [m]
  float beside;       ///< those closer together are the same one from step to step. [m]
};

/// Slot 0 for regular contacts; with segments, kContactsPerSegment slots for each. Made when first needed.
class Manifolds {
 public:
  explicit Manifolds(btDispatcher* dispatcher) : dispatcher_(dispatcher) {}
  ~Manifolds();
  Manifolds(const Manifolds&) = delete;
  Manifolds& operator=(const Manifolds&) = delete;

  /// Gives the points of all manifolds their places in this step. Bullet's refresh would keep the normals of the step
  /// they were made in.
  /// @param contacts  in order of their slots; for each slot at most as many as a manifold holds
  void replace(const Pair& pair, std::span<const ManifoldContact> contacts, const Placing& placing,
               btManifoldResult* result);
  /// Removes the points of all manifolds.
  void clear();
  /// Gives back all manifolds.
  void release() {
    filled_.resize(0);
    release_from(0);
  }
  void append_to(btManifoldArray& all) const;

 private:
  // @param contacts  of one slot
  void fill(int slot, const Pair& pair, std::span<const ManifoldContact> contacts, const Placing& placing,
            btManifoldResult* result);
  // Gives back the manifolds of a slot and of all after it: Bullet visits empty ones in every step.
  void release_from(int slot);
  btPersistentManifold* manifold(int slot, const btManifoldResult* result, btScalar threshold);

  btDispatcher* dispatcher_;
  btAlignedObjectArray<btPersistentManifold*> manifolds_;  // null where none was needed
  btAlignedObjectArray<int> filled_;                       // slots with points, rising
};

}  // namespace vps::bullet
