// SPDX-License-Identifier: Zlib
// Asks the algorithms of a compound's children. As Bullet's own, but bounds are swept as those of the broadphase are.
#include "runtime/bullet/compound_algorithm.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <vector>

#include "runtime/bullet/partners/for_each_leaf.h"

namespace vps::bullet {
namespace {

bool has_shape(const btCollisionObjectWrapper& body) {
  bool found = false;
  for_each_leaf({body.getCollisionShape(), btTransform::getIdentity()},
                [&](const Leaf& leaf) { found = found || as_vps(leaf.shape) != nullptr; });
  return found;
}

// The children of a compound whose bounds overlap a box, rising.
// @param low, high  compound's frame. [m]
void find_children(const btCompoundShape& compound, const btVector3& low, const btVector3& high,
                   std::vector<int>& children) {
  struct Collect final : btDbvt::ICollide {
    std::vector<int>& children;
    explicit Collect(std::vector<int>& to) : children(to) {}
    void Process(const btDbvtNode* leaf) override { children.push_back(leaf->dataAsInt); }
  };
  children.clear();
  if (const btDbvt* const tree = compound.getDynamicAabbTree()) {
    Collect collect(children);
    tree->collideTV(tree->m_root, btDbvtVolume::FromMM(low, high), collect);
    std::sort(children.begin(), children.end());
    return;
  }
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    btVector3 child_low;
    btVector3 child_high;
    compound.getChildShape(i)->getAabb(compound.getChildTransform(i), child_low, child_high);
    if (TestAabbAgainstAabb2(child_low, child_high, low, high)) children.push_back(i);
  }
}

// Bullet's own algorithms ask these callbacks of the program, too.
void remove_unwanted(std::vector<int>& children, const btCompoundShape& compound,
                     const btCollisionObjectWrapper& other) {
  if (other.getCollisionShape()->isCompound()) return;  // its own children will be asked
  const bool is_child = other.m_parent != nullptr;
  const btShapePairCallback is_wanted =
      is_child ? gCompoundCompoundChildShapePairCallback : gCompoundChildShapePairCallback;
  if (is_wanted == nullptr) return;
  const auto is_unwanted = [&](int child) {
    return !is_wanted(compound.getChildShape(child), other.getCollisionShape());
  };
  children.erase(std::remove_if(children.begin(), children.end(), is_unwanted), children.end());
}

class CompoundAlgorithm final : public btCollisionAlgorithm {
 public:
  CompoundAlgorithm(const btCollisionAlgorithmConstructionInfo& info, LookAhead ahead)
      : btCollisionAlgorithm(info), ahead_(ahead) {}
  CompoundAlgorithm(const CompoundAlgorithm&) = delete;
  CompoundAlgorithm& operator=(const CompoundAlgorithm&) = delete;
  ~CompoundAlgorithm() override { forget_all_but({}); }

  void processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                        const btDispatcherInfo& info, btManifoldResult* result) override;

  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    for (const Part& part : parts_) part.algorithm->getAllContactManifolds(manifolds);
  }

 private:
  struct Part {
    int child;
    btCollisionAlgorithm* algorithm;
  };

  // @param children  rising
  void forget_all_but(const std::vector<int>& children);
  void process_child(int child, btCollisionAlgorithm*& algorithm, const btCollisionObjectWrapper& whole,
                     const btCollisionObjectWrapper& other, const btDispatcherInfo& info, btManifoldResult& result);

  const LookAhead ahead_;
  int revision_ = -1;        // of the compound's children
  std::vector<Part> parts_;  // children that are near, rising
  std::vector<int> near_;    // of one call
};
// As for ContactAlgorithm.
static_assert(sizeof(CompoundAlgorithm) <= 192);

void CompoundAlgorithm::processCollision(const btCollisionObjectWrapper* first, const btCollisionObjectWrapper* second,
                                         const btDispatcherInfo& info, btManifoldResult* result) {
  if (!first->getCollisionShape()->isCompound()) std::swap(first, second);
  const auto& compound = static_cast<const btCompoundShape&>(*first->getCollisionShape());
  if (revision_ != compound.getUpdateRevision()) forget_all_but({});
  revision_ = compound.getUpdateRevision();
  const btScalar room = gContactBreakingThreshold + result->m_closestPointDistanceThreshold +
                        btScalar(way_ahead(PairBody(first), PairBody(second), info.m_timeStep, ahead_));
  btVector3 low;
  btVector3 high;
  second->getCollisionShape()->getAabb(first->getWorldTransform().inverseTimes(second->getWorldTransform()), low, high);
  const btVector3 around(room, room, room);
  find_children(compound, low - around, high + around, near_);
  remove_unwanted(near_, compound, *second);
  forget_all_but(near_);
  for (std::size_t i = 0; i < near_.size(); ++i) {
    if (i == parts_.size() || parts_[i].child != near_[i]) {
      parts_.insert(parts_.begin() + static_cast<std::ptrdiff_t>(i), {near_[i], nullptr});
    }
    process_child(near_[i], parts_[i].algorithm, *first, *second, info, *result);
  }
}

void CompoundAlgorithm::forget_all_but(const std::vector<int>& children) {
  const auto forget = [&](const Part& part) {
    if (std::binary_search(children.begin(), children.end(), part.child)) return false;
    part.algorithm->~btCollisionAlgorithm();
    m_dispatcher->freeCollisionAlgorithm(part.algorithm);
    return true;
  };
  parts_.erase(std::remove_if(parts_.begin(), parts_.end(), forget), parts_.end());
}

void CompoundAlgorithm::process_child(int child, btCollisionAlgorithm*& algorithm,
                                      const btCollisionObjectWrapper& whole, const btCollisionObjectWrapper& other,
                                      const btDispatcherInfo& info, btManifoldResult& result) {
  const auto& compound = static_cast<const btCompoundShape&>(*whole.getCollisionShape());
  const btTransform& local = compound.getChildTransform(child);
  const btTransform world = whole.getWorldTransform() * local;
  const btCollisionObjectWrapper part(&whole, compound.getChildShape(child), whole.getCollisionObject(), world, local,
                                      -1, child);
  if (algorithm == nullptr) {
    const bool ahead = ahead_ == LookAhead::yes;
    algorithm = m_dispatcher->findAlgorithm(&part, &other, nullptr,
                                            ahead ? BT_CONTACT_POINT_ALGORITHMS : BT_CLOSEST_POINT_ALGORITHMS);
  }
  const bool is_first = result.getBody0Internal() == whole.getCollisionObject();
  const btCollisionObjectWrapper* const before = is_first ? result.getBody0Wrap() : result.getBody1Wrap();
  is_first ? result.setBody0Wrap(&part) : result.setBody1Wrap(&part);
  is_first ? result.setShapeIdentifiersA(-1, child) : result.setShapeIdentifiersB(-1, child);
  algorithm->processCollision(&part, &other, info, &result);
  is_first ? result.setBody0Wrap(before) : result.setBody1Wrap(before);
}

}  // namespace

btCollisionAlgorithm* create_for_compounds(btCollisionAlgorithmConstructionInfo& info,
                                           const btCollisionObjectWrapper* first,
                                           const btCollisionObjectWrapper* second, LookAhead ahead) {
  if (has_shape(*first) || has_shape(*second)) {
    void* const memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(CompoundAlgorithm));
    return new (memory) CompoundAlgorithm(info, ahead);
  }
  btCollisionConfiguration& stock =
      *static_cast<btCollisionDispatcher*>(info.m_dispatcher1)->getCollisionConfiguration();
  const int types[] = {first->getCollisionShape()->getShapeType(), second->getCollisionShape()->getShapeType()};
  btCollisionAlgorithmCreateFunc* const create = ahead == LookAhead::yes
                                                     ? stock.getCollisionAlgorithmCreateFunc(types[0], types[1])
                                                     : stock.getClosestPointsAlgorithmCreateFunc(types[0], types[1]);
  return create->CreateCollisionAlgorithm(info, first, second);
}

}  // namespace vps::bullet
