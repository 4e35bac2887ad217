// SPDX-License-Identifier: Zlib
// The collision algorithm that Bullet's dispatcher calls for each pair with a Shape. Paper: Secs. 2.4 and 3.2.
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <utility>

#include "runtime/bullet/lint.h"
#include "runtime/bullet/manifolds.h"
#include "runtime/bullet/partners/partner.h"
#include "runtime/contacts/side_contacts.h"

namespace vps::bullet {
namespace {

enum class LookAhead : std::uint8_t { no, yes };

// What a pair remembers from step to step, as long as its shapes stay as they are.
struct Memory {
  const btCollisionShape *shell, *field;
  btVector3 shell_scale, field_scale;
  detail::PairMemory contacts;
  PairPartner partner;

  explicit Memory(const Pair& pair)
      : shell(pair.shell.shape),
        field(pair.field.shape),
        shell_scale(shell->getLocalScaling()),
        field_scale(field->getLocalScaling()) {}
  [[nodiscard]] bool is_of(const Pair& pair) const {
    return shell == pair.shell.shape && field == pair.field.shape && shell_scale == shell->getLocalScaling() &&
           field_scale == field->getLocalScaling();
  }
};

// The contacts of one body's points in the other body.
class ShellContacts {
 public:
  /// @param looks_ahead  yes: finds speculative contacts of the step too; no: for contactTest and similar queries
  ShellContacts(btDispatcher* dispatcher, LookAhead looks_ahead) : manifolds_(dispatcher), looks_ahead_(looks_ahead) {}

  void find(const Pair& pair, btScalar step, btManifoldResult* result);
  void append_to(btManifoldArray& manifolds) const { manifolds_.append_to(manifolds); }

 private:
  void leave_apart() {
    manifolds_.clear();
    if (memory_ != nullptr) memory_->contacts.leave_apart();
  }

  Manifolds manifolds_;
  const LookAhead looks_ahead_;
  std::unique_ptr<Memory> memory_;  // none before the bodies come near each other
};

class ContactAlgorithm final : public btCollisionAlgorithm {
 public:
  ContactAlgorithm(const btCollisionAlgorithmConstructionInfo& info, LookAhead looks_ahead)
      : btCollisionAlgorithm(info), contacts_(info.m_dispatcher1, looks_ahead), looks_ahead_(looks_ahead) {}

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    contacts_.append_to(manifolds);
    if (others_ != nullptr) others_->append_to(manifolds);
  }

 private:
  ShellContacts contacts_;
  std::unique_ptr<ShellContacts> others_;  // with the roles exchanged; none for shells with points everywhere
  const LookAhead looks_ahead_;
};
// Bullet allocates algorithms from a pool of fixed-size elements, and its release builds do not check the size.
static_assert(sizeof(ContactAlgorithm) <= 192);

void ContactAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                        const btDispatcherInfo& info, btManifoldResult* result) {
  const PairBody a(first);
  const PairBody b(second);
  if (a.vps == nullptr && b.vps == nullptr) return;  // another class with Shape's shape type
  const Pair pair = assign_roles(a, b);
  contacts_.find(pair, info.m_timeStep, result);
  if (!pair.both) return others_.reset();
  if (others_ == nullptr) others_ = std::make_unique<ShellContacts>(m_dispatcher, looks_ahead_);
  others_->find({pair.field, pair.shell, pair.both}, info.m_timeStep, result);
}

void ShellContacts::find(const Pair& pair, btScalar step, btManifoldResult* result) {
  if (memory_ != nullptr && !memory_->is_of(pair)) memory_.reset();
  detail::StepPair of_step = in_step(pair);
  StepMotion motions[2];
  const auto wanted = static_cast<float>(result->m_closestPointDistanceThreshold);
  detail::SideQuery query{std::max(of_step.touching(), wanted), pair.both, pair.shell.vps->flat_patches()};
  if (looks_ahead_ == LookAhead::yes) add_motions(pair, step, motions, of_step);
  query.approach = detail::approach(of_step);
  const double reach = double{query.distance + query.approach.way};
  if (memory_ != nullptr && memory_->contacts.knows_apart(of_step, reach)) return leave_apart();
  const bool touched = memory_ != nullptr && memory_->contacts.touched;
  if (!touched && are_apart(of_step, box_of(pair.field), reach)) return leave_apart();
  if (memory_ == nullptr) memory_ = std::make_unique<Memory>(pair);
  detail::SideContacts found;
  const std::optional<detail::Partner> partner = memory_->partner.of(pair, query.approach.way > 0);
  const Status status = partner ? contacts_of_side(of_step, *partner, query, memory_->contacts, workspace(), found)
                                : Status::bad_argument;
  if (status != Status::ok) {
    pair.shell.vps->report(status);
    if (pair.field.vps != nullptr) pair.field.vps->report(status);
    manifolds_.release();
    return memory_->contacts.leave_apart();
  }
  const btTransform frame =
      found.in_shell_frame ? pair.shell.world * pair.shell.asset_frame() : pair.field.world * field_frame(pair.field);
  manifolds_.replace(pair, found.contacts, {frame, found.reach, of_step.beside()}, result);
}

std::atomic<bool> registered{false};

template <LookAhead looks_ahead>
struct CreateContactAlgorithm final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper*,
                                                 const btCollisionObjectWrapper*) override {
    void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(ContactAlgorithm));
    return new (memory) ContactAlgorithm(info, looks_ahead);
  }
};

}  // namespace

bool is_any_dispatcher_registered() {
  return registered.load(std::memory_order_relaxed);
}

void register_algorithm(btCollisionDispatcher& dispatcher) {
  registered.store(true, std::memory_order_relaxed);
  // Stateless: one instance serves every dispatcher and outlives them all. The algorithm finds the bodies' roles by
  // their shapes, so it needs no swapped variant.
  static CreateContactAlgorithm<LookAhead::yes> create;
  static CreateContactAlgorithm<LookAhead::no> create_for_tests;
  for (int partner = 0; partner < CONCAVE_SHAPES_END_HERE; ++partner) {
    if (partner != kProxyType && !is_partner_field(partner) && !is_triangle_mesh(partner)) continue;
    dispatcher.registerCollisionCreateFunc(kProxyType, partner, &create);
    dispatcher.registerCollisionCreateFunc(partner, kProxyType, &create);
    dispatcher.registerClosestPointsCreateFunc(kProxyType, partner, &create_for_tests);
    dispatcher.registerClosestPointsCreateFunc(partner, kProxyType, &create_for_tests);
  }
  // GImpact's algorithm would use the surfels of Shapes in compounds. Bullet's own algorithm queries each child.
  btCollisionConfiguration* const stock = dispatcher.getCollisionConfiguration();
  for (const auto& [first, second] : {std::pair{COMPOUND_SHAPE_PROXYTYPE, GIMPACT_SHAPE_PROXYTYPE},
                                      std::pair{GIMPACT_SHAPE_PROXYTYPE, COMPOUND_SHAPE_PROXYTYPE}}) {
    dispatcher.registerCollisionCreateFunc(first, second, stock->getCollisionAlgorithmCreateFunc(first, second));
  }
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
