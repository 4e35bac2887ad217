// SPDX-License-Identifier: Zlib
// The collision algorithm that Bullet's dispatcher calls for each pair with a Shape. Paper: Secs. 2.4 and 3.2.
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include "runtime/bullet/body_motion.h"
#include "runtime/bullet/compound_algorithm.h"
#include "runtime/bullet/lint.h"
#include "runtime/bullet/manifolds.h"
#include "runtime/bullet/partners/partner.h"
#include "runtime/contacts/known_gap.h"
#include "runtime/contacts/side_contacts.h"

namespace vps::bullet {
namespace {

// One body's points in the other body, from step to step.
struct ShellContacts {
  Manifolds manifolds;
  detail::PairMemory memory;  // as long as the shapes stay as they are
  PairPartner partner;
  bool are_all = false;  // in this step: the other body's points are not needed

  explicit ShellContacts(btDispatcher* dispatcher) : manifolds(dispatcher) {}
  void forget() { memory = {}, partner = {}; }
  void leave_apart() {
    manifolds.clear();
    memory.leave_apart();
  }
};

class ContactAlgorithm final : public btCollisionAlgorithm {
 public:
  /// @param ahead  yes: finds speculative contacts of the step too; no: for contactTest and similar queries
  ContactAlgorithm(const btCollisionAlgorithmConstructionInfo& info, LookAhead ahead)
      : btCollisionAlgorithm(info), ahead_(ahead) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    for_each_side([&](const ShellContacts& side) { side.manifolds.append_to(manifolds); });
  }

 private:
  // @return a distance that the bodies surely have, without their margins; at most 0: none. [m]
  double find(std::unique_ptr<ShellContacts>& side, const Pair& pair, const PairStep& step, btManifoldResult* result);
  template <class Call>
  void for_each_side(const Call& call) {
    for (const std::unique_ptr<ShellContacts>& side : sides_) {
      if (side != nullptr) call(*side);
    }
  }

  // A pair that is apart needs nothing else: the memories of thousands of pairs fit no cache.
  detail::KnownGap gap_;
  SeenShapes seen_;
  const LookAhead ahead_;
  // Made when the bodies come near. The second has the roles exchanged; none for shells with points everywhere.
  std::unique_ptr<ShellContacts> sides_[2];
};
// Bullet allocates algorithms from a pool of fixed-size elements, and its release builds do not check the size.
static_assert(sizeof(ContactAlgorithm) <= 192);

void ContactAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                        const btDispatcherInfo& info, btManifoldResult* result) {
  for (const btCollisionObjectWrapper* const wrap : {first, second}) fetch_motion(*wrap->getCollisionObject());
  const PairBody a(first);
  const PairBody b(second);
  if (a.vps == nullptr && b.vps == nullptr) return;  // another class with Shape's shape type
  if (seen_.change_to(a, b)) {
    gap_ = {};
    for_each_side([](ShellContacts& side) { side.forget(); });
  }
  PairStep step = step_of(a, b, info.m_timeStep, result->m_closestPointDistanceThreshold, ahead_);
  const detail::PlaceRef<btScalar> places[2] = {place_of(a), place_of(b)};
  // The sides have had no contacts since the gap was proven.
  if (gap_.exceeds(static_cast<float>(step.reach) + step.margin, places)) return;
  const Pair pair = assign_roles(a, b);
  if (pair.shell.object != a.object) std::swap(step.motions[0], step.motions[1]);
  double gap = find(sides_[0], pair, step, result);
  if (pair.both && !(sides_[0] != nullptr && sides_[0]->are_all)) {
    std::swap(step.motions[0], step.motions[1]);
    gap = std::min(gap, find(sides_[1], {pair.field, pair.shell, pair.both}, step, result));
  } else {
    sides_[1].reset();
  }
  gap_ = gap > step.reach ? detail::KnownGap(gap, places, {arm_of(a), arm_of(b)}) : detail::KnownGap();
}

double ContactAlgorithm::find(std::unique_ptr<ShellContacts>& side, const Pair& pair, const PairStep& step,
                              btManifoldResult* result) {
  const detail::StepPair of_step = in_step(pair, &step);
  const double reach = step.reach + double{of_step.margin};
  if (side != nullptr) side->are_all = false;
  double gap = side != nullptr ? side->memory.known_distance(of_step) : 0;
  if (!(gap > reach) && (side == nullptr || !side->memory.touched)) gap = distance_to_box(of_step, box_of(pair.field));
  if (gap > reach) {
    if (side != nullptr) side->leave_apart();
    return is_triangle_mesh(pair.field.shape->getShapeType()) ? 0 : gap;  // triangles may move
  }
  if (side == nullptr) side = std::make_unique<ShellContacts>(m_dispatcher);
  detail::SideQuery query = step.query;
  query.leaves_faces = pair.both;
  query.flat_patches = pair.shell.vps->flat_patches();
  detail::SideContacts found;
  const std::optional<detail::Partner> other = side->partner.of(pair, query.approach.way > 0);
  const Status status =
      other ? contacts_of_side(of_step, *other, query, side->memory, workspace(), found) : Status::bad_argument;
  if (status != Status::ok) {
    pair.shell.vps->report(status);
    if (pair.field.vps != nullptr) pair.field.vps->report(status);
    side->manifolds.release();
    side->memory.leave_apart();
    return 0;
  }
  side->are_all = found.are_all;
  const btTransform frame = to_bt(found.in_shell_frame ? of_step.shell_pose : of_step.field_pose);
  side->manifolds.replace(pair, found.contacts, {frame, found.reach, query.distance, of_step.beside()}, result);
  return found.contacts.empty() ? side->memory.known_distance(of_step) : 0;
}

std::atomic<bool> registered{false};

btCollisionAlgorithm* create_for_shapes(btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper*,
                                        const btCollisionObjectWrapper*, LookAhead ahead) {
  void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(ContactAlgorithm));
  return new (memory) ContactAlgorithm(info, ahead);
}

// Stateless: one instance serves every dispatcher and outlives them all.
template <auto kCreate, LookAhead kAhead>
struct CreateAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* first,
                                                 const btCollisionObjectWrapper* second) override {
    return kCreate(info, first, second, kAhead);
  }
};

// For both orders of a pair, in the tables for steps and for tests.
template <auto kCreate>
void register_pair(btCollisionDispatcher& dispatcher, int type, int other) {
  static CreateAlgorithm<kCreate, LookAhead::yes> create;
  static CreateAlgorithm<kCreate, LookAhead::no> create_for_tests;
  for (const auto& [first, second] : {std::pair{type, other}, std::pair{other, type}}) {
    dispatcher.registerCollisionCreateFunc(first, second, &create);
    dispatcher.registerClosestPointsCreateFunc(first, second, &create_for_tests);
  }
}

}  // namespace

bool is_any_dispatcher_registered() {
  return registered.load(std::memory_order_relaxed);
}

void register_algorithm(btCollisionDispatcher& dispatcher) {
  registered.store(true, std::memory_order_relaxed);
  // The algorithms find the bodies' roles by their shapes, so they need no swapped variants.
  for (int partner = 0; partner < CONCAVE_SHAPES_END_HERE; ++partner) {
    if (partner != kProxyType && !is_partner_field(partner) && !is_triangle_mesh(partner)) continue;
    register_pair<create_for_shapes>(dispatcher, kProxyType, partner);
    // GImpact's algorithm would use the surfels of Shapes in compounds.
    register_pair<create_for_compounds>(dispatcher, COMPOUND_SHAPE_PROXYTYPE, partner);
  }
  register_pair<create_for_compounds>(dispatcher, COMPOUND_SHAPE_PROXYTYPE, COMPOUND_SHAPE_PROXYTYPE);
}

bool is_registered(btDispatcher& dispatcher, const Shape& shape) {
  btCollisionObject object;
  object.setCollisionShape(const_cast<Shape*>(&shape));
  const btCollisionObjectWrapper wrap(nullptr, &shape, &object, object.getWorldTransform(), -1, -1);
  btCollisionAlgorithm* const found = dispatcher.findAlgorithm(&wrap, &wrap, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (found == nullptr) return false;
  const bool ours = dynamic_cast<ContactAlgorithm*>(found) != nullptr;
  found->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(found);
  return ours;
}

}  // namespace vps::bullet
