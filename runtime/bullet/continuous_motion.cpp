// SPDX-License-Identifier: Zlib
// After Bullet has moved fast bodies, puts them back to where they touch, by conservative advancement.
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include "runtime/bullet/body_motion.h"
#include "runtime/bullet/lint.h"
#include "runtime/bullet/partners/for_each_leaf.h"
#include "runtime/bullet/partners/partner.h"
#include "runtime/vps_queries.h"

namespace vps::bullet {
namespace {

struct Mover {
  btCollisionObject* object;
  PastMotion motion;
  btScalar end;  // time to which it is put back. [s]
  // By the kinematic body that it meets then, in the rest of the step.
  btTransform carried = btTransform::getIdentity();

  Mover(btCollisionObject* of, btScalar step) : object(of), motion(*of, step), end(step) {}
  void swept(btVector3& low, btVector3& high) const {
    btVector3 other_low;
    btVector3 other_high;
    object->getCollisionShape()->getAabb(motion.at(0), low, high);
    object->getCollisionShape()->getAabb(object->getWorldTransform(), other_low, other_high);
    low.setMin(other_low);
    high.setMax(other_high);
  }
};

// @param bound  upper bound of the shell's penetration into its partner. [m]
// @return false where the query fails
bool bound_penetration(const Pair& pair, PairPartner& partners, std::uint32_t& guess, double& bound) {
  const std::optional<detail::Partner> partner = partners.of(pair, false);
  if (!partner || partner->sheet != nullptr) return false;
  const detail::StepPair of_step = in_step(pair);
  SeparationOptions options;
  options.tolerance = 0.1F * of_step.touching();
  options.guess = guess;
  if (pair.field.vps != nullptr) options.field_shell = &pair.field.vps->pointshell();
  SeparationResult result;
  const Status status =
      separation(of_step.shell, partner->field, of_step.shell_to_field, options, workspace().scratch, result);
  guess = result.point;
  bound = result.delta_bound + double{of_step.margin};
  return status == Status::ok;
}

// Time when two leaves first touch. If they touch at the start: the time when they are a little deeper. [s]
// @return `step` if that does not happen in the step
btScalar impact(const Mover& a, const Leaf& leaf_a, const Mover& b, const Leaf& leaf_b, btScalar step,
                std::uint32_t max_iterations) {
  btTransform at_a;  // of the last pair
  btTransform at_b;
  const auto pair_at = [&](btScalar time) {
    at_a = a.motion.at(time) * leaf_a.local;
    at_b = b.motion.at(time) * leaf_b.local;
    return assign_roles(PairBody(leaf_a.shape, a.object, at_a), PairBody(leaf_b.shape, b.object, at_b));
  };
  if (as_vps(leaf_a.shape) == nullptr && as_vps(leaf_b.shape) == nullptr) return step;
  const double speed = double((a.motion.drift() - b.motion.drift()).length() + a.motion.swing() + b.motion.swing());
  const Pair start = pair_at(0);
  const double reach = double{in_step(start).touching()};  // the next step finds contacts within this distance. [m]
  PairPartner partners;
  std::uint32_t guess = 0;
  double allowed = 0;
  double gap = 0;
  const auto look_at = [&](double time) {
    double deepest = 0;
    if (!bound_penetration(pair_at(static_cast<btScalar>(time)), partners, guess, deepest)) return false;
    gap = allowed - deepest;
    return true;
  };
  if (!look_at(0)) return step;
  const double penetration = -gap;
  const bool apart = penetration < -0.5 * reach;
  // Springs need penetration to push: a body held at the surface would only gain speed.
  if (!apart && foundation_of(start).stiffness > 0) return step;
  allowed = std::max(-0.5 * reach, penetration + 2.5 * reach);
  gap += allowed;
  double time = 0;
  for (std::uint32_t i = 1; i < max_iterations && gap > 0.25 * reach; ++i) {
    time += gap / speed;
    if (!(time < double(step))) return step;
    if (!look_at(time)) return step;
  }
  if (gap <= 0.25 * reach) return static_cast<btScalar>(time);
  // The iterations have run out: the bodies move along each other. They go on in even steps, up to where one of these
  // is too deep. Those that slide or roll may come a little deeper.
  if (!apart) {
    const double slides = 20 * reach;  // two voxels: touching() is a tenth of one
    allowed += slides;
    gap += slides;
  }
  // Steps of half a body pass no wall. Those of tiny bodies would be thousands.
  constexpr double kMostSteps = 4;
  const double longest = (double(step) - time) / max_iterations;
  const double half = double{sphere_radius(in_step(start).shell, 0)} / speed;
  const double least = std::clamp(half, longest / kMostSteps, longest);
  while (time < double(step)) {
    const double before = time;
    time = std::min(time + std::max(least, gap / speed), double(step));
    if (!look_at(time)) return step;
    if (gap < 0) return static_cast<btScalar>(before);
  }
  return step;
}

class CandidateCallback final : public btBroadphaseAabbCallback {
 public:
  explicit CandidateCallback(const btBroadphaseProxy* self) : self_(self) {}
  bool process(const btBroadphaseProxy* proxy) override {
    if (proxy != self_) found.push_back(static_cast<btCollisionObject*>(proxy->m_clientObject));
    return true;
  }
  std::vector<btCollisionObject*> found;

 private:
  const btBroadphaseProxy* self_;
};

bool may_collide(btCollisionWorld& world, btCollisionObject& a, btCollisionObject& b) {
  return a.hasContactResponse() && b.hasContactResponse() && a.checkCollideWith(&b) && b.checkCollideWith(&a) &&
         world.getPairCache()->needsBroadphaseCollision(a.getBroadphaseHandle(), b.getBroadphaseHandle());
}

void advance(Mover& fast, Mover& other, btScalar step, std::uint32_t max_iterations) {
  for_each_leaf(*fast.object, [&](const Leaf& a) {
    for_each_leaf(*other.object, [&](const Leaf& b) {
      const btScalar time = impact(fast, a, other, b, step, max_iterations);
      other.end = btMin(other.end, time);
      if (!(time < fast.end)) return;
      fast.end = time;
      const bool carries = !other.motion.moves() && other.motion.speed() > 0;
      fast.carried = carries ? other.motion.at(step) * other.motion.at(time).inverse() : btTransform::getIdentity();
    });
  });
}

}  // namespace

void ContinuousMotion::updateAction(btCollisionWorld* world, btScalar step) {
  const btCollisionObjectArray& objects = world->getCollisionObjectArray();
  btScalar finest = std::numeric_limits<btScalar>::infinity();
  const Shape* any = nullptr;
  for (int i = 0; i < objects.size(); ++i) {
    for_each_leaf(*objects[i], [&](const Leaf& leaf) {
      const Shape* const shape = as_vps(leaf.shape);
      if (shape == nullptr) return;
      any = shape;
      finest = btMin(finest, static_cast<btScalar>(shape->info().voxel_size));
    });
  }
  if (any != nullptr && checked_ != world->getDispatcher()) {
    checked_ = world->getDispatcher();
    if (!is_registered(*world->getDispatcher(), *any)) any->report_not_registered();
  }
  const btScalar least = btScalar(options_.free_vx) * finest;

  std::vector<Mover> fast;
  for (int i = 0; i < objects.size(); ++i) {
    const Mover mover(objects[i], step);
    if (mover.motion.moves() && mover.motion.speed() * step > least) fast.push_back(mover);
  }
  for (std::size_t i = 0; i < fast.size(); ++i) {
    btVector3 low;
    btVector3 high;
    fast[i].swept(low, high);
    // Two fast bodies may meet where the broadphase has neither: compares their swept bounds.
    for (std::size_t k = i + 1; k < fast.size(); ++k) {
      btVector3 other_low;
      btVector3 other_high;
      fast[k].swept(other_low, other_high);
      if (!TestAabbAgainstAabb2(low, high, other_low, other_high)) continue;
      if (may_collide(*world, *fast[i].object, *fast[k].object)) {
        advance(fast[i], fast[k], step, options_.max_iterations);
      }
    }
    CandidateCallback candidates(fast[i].object->getBroadphaseHandle());
    world->getBroadphase()->aabbTest(low, high, candidates);
    for (btCollisionObject* const object : candidates.found) {
      const auto is_object = [&](const Mover& mover) { return mover.object == object; };
      if (std::any_of(fast.begin(), fast.end(), is_object) || !may_collide(*world, *fast[i].object, *object)) continue;
      Mover other(object, step);
      advance(fast[i], other, step, options_.max_iterations);
    }
  }
  for (std::size_t i = 0; i < fast.size(); ++i) {
    const btMultiBody* const multibody = fast[i].motion.multibody();
    // The links of a multibody go back together, with the first of them.
    const auto is_of_it = [&](const Mover& other) {
      return multibody != nullptr && other.motion.multibody() == multibody;
    };
    if (std::any_of(fast.begin(), fast.begin() + static_cast<std::ptrdiff_t>(i), is_of_it)) continue;
    btScalar end = fast[i].end;
    for (std::size_t k = i + 1; k < fast.size(); ++k) {
      if (is_of_it(fast[k])) end = btMin(end, fast[k].end);
    }
    if (!(end < step)) continue;
    fast[i].motion.put_back(end, fast[i].carried);
    ++stops_;
  }
}

}  // namespace vps::bullet
