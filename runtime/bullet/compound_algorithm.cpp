// SPDX-License-Identifier: Zlib
// Asks the algorithms of a compound's children. As Bullet's own, but bounds are swept as those of the broadphase are.
#include "runtime/bullet/compound_algorithm.h"

#include <BulletCollision/BroadphaseCollision/btDbvt.h>
#include <BulletCollision/CollisionDispatch/btCollisionConfiguration.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <LinearMath/btAabbUtil2.h>

#include <algorithm>
#include <vector>

namespace vps::bullet {
namespace {

// Bodies of thousands of children come here for each contactTest: no poses, and no more children than needed.
bool has_shape(const btCollisionShape& shape) {
  if (!shape.isCompound()) return as_vps(&shape) != nullptr;
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    if (has_shape(*compound.getChildShape(i))) return true;
  }
  return false;
}

// The plain one of the two first: a compound may have thousands of children.
bool has_shape(const btCollisionObjectWrapper& first, const btCollisionObjectWrapper& second) {
  const bool is_swapped = first.getCollisionShape()->isCompound();
  return has_shape(*(is_swapped ? second : first).getCollisionShape()) ||
         has_shape(*(is_swapped ? first : second).getCollisionShape());
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

// Bullet's own pairs have no contacts ahead, but a manifold's threshold grows with the whole compound: only children
// whose bounds overlap are asked, as by Bullet. Else a sphere hits the joints of a floor of boxes that it flies over.
void remove_apart(std::vector<int>& children, const btCollisionObjectWrapper& whole,
                  const btCollisionObjectWrapper& other, btScalar distance) {
  const btCollisionShape& second = *other.getCollisionShape();
  if (second.isCompound() || as_vps(&second) != nullptr) return;
  const auto& compound = static_cast<const btCompoundShape&>(*whole.getCollisionShape());
  btVector3 low;
  btVector3 high;
  second.getAabb(other.getWorldTransform(), low, high);
  const btVector3 around(distance, distance, distance);
  const auto is_apart = [&](int child) {
    const btCollisionShape& shape = *compound.getChildShape(child);
    if (shape.isCompound() || as_vps(&shape) != nullptr) return false;
    btVector3 child_low;
    btVector3 child_high;
    shape.getAabb(whole.getWorldTransform() * compound.getChildTransform(child), child_low, child_high);
    return !TestAabbAgainstAabb2(child_low - around, child_high + around, low, high);
  };
  children.erase(std::remove_if(children.begin(), children.end(), is_apart), children.end());
}

// Bullet's own algorithms ask these callbacks of the program, too.
void remove_unwanted(std::vector<int>& children, const btCompoundShape& compound, const btCollisionObjectWrapper& other,
                     bool is_second) {
  if (other.getCollisionShape()->isCompound()) return;  // its own children will be asked
  const bool is_child = other.m_parent != nullptr;
  const btShapePairCallback is_wanted =
      is_child ? gCompoundCompoundChildShapePairCallback : gCompoundChildShapePairCallback;
  if (is_wanted == nullptr) return;
  // Of two children Bullet names the first body's first, otherwise the other body.
  const bool is_swapped = !is_child || is_second;
  const auto is_unwanted = [&](int child) {
    return is_swapped ? !is_wanted(other.getCollisionShape(), compound.getChildShape(child))
                      : !is_wanted(compound.getChildShape(child), other.getCollisionShape());
  };
  children.erase(std::remove_if(children.begin(), children.end(), is_unwanted), children.end());
}

class CompoundAlgorithm final : public btCollisionAlgorithm {
 public:
  CompoundAlgorithm(const btCollisionAlgorithmConstructionInfo& info, LookAhead ahead)
      : btCollisionAlgorithm(info), ahead_(ahead) {}
  static btCollisionAlgorithm* create(btDispatcher& dispatcher, LookAhead ahead) {
    void* const memory = dispatcher.allocateCollisionAlgorithm(sizeof(CompoundAlgorithm));
    return new (memory) CompoundAlgorithm(btCollisionAlgorithmConstructionInfo(&dispatcher, -1), ahead);
  }
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
  btCollisionAlgorithm* find(const btCollisionObjectWrapper& part, const btCollisionObjectWrapper& other,
                             btScalar distance);
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
  const WayAhead ahead = way_ahead(PairBody(first), PairBody(second), info.m_timeStep, ahead_);
  const btScalar room = gContactBreakingThreshold + result->m_closestPointDistanceThreshold + ahead.around;
  const btVector3 way = ahead.way * first->getWorldTransform().getBasis();
  btVector3 low;
  btVector3 high;
  second->getCollisionShape()->getAabb(first->getWorldTransform().inverseTimes(second->getWorldTransform()), low, high);
  const btVector3 around(room, room, room);
  btVector3 swept_low = low + way;
  btVector3 swept_high = high + way;
  swept_low.setMin(low);
  swept_high.setMax(high);
  find_children(compound, swept_low - around, swept_high + around, near_);
  remove_apart(near_, *first, *second, result->m_closestPointDistanceThreshold);
  remove_unwanted(near_, compound, *second, result->getBody0Internal() != first->getCollisionObject());
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

btCollisionAlgorithm* CompoundAlgorithm::find(const btCollisionObjectWrapper& part,
                                              const btCollisionObjectWrapper& other, btScalar distance) {
  const btCollisionShape& first = *part.getCollisionShape();
  const btCollisionShape& second = *other.getCollisionShape();
  // Never Bullet's own for a child and a compound: each would pass through all children of the compound in each step.
  if (first.isCompound() || second.isCompound()) return create(*m_dispatcher, ahead_);
  // As Bullet: its own shapes have all of their contacts in tests without a distance.
  const bool closest =
      ahead_ == LookAhead::no && (distance > 0 || as_vps(&first) != nullptr || as_vps(&second) != nullptr);
  return m_dispatcher->findAlgorithm(&part, &other, nullptr,
                                     closest ? BT_CLOSEST_POINT_ALGORITHMS : BT_CONTACT_POINT_ALGORITHMS);
}

void CompoundAlgorithm::process_child(int child, btCollisionAlgorithm*& algorithm,
                                      const btCollisionObjectWrapper& whole, const btCollisionObjectWrapper& other,
                                      const btDispatcherInfo& info, btManifoldResult& result) {
  const auto& compound = static_cast<const btCompoundShape&>(*whole.getCollisionShape());
  const btTransform& local = compound.getChildTransform(child);
  const btTransform world = whole.getWorldTransform() * local;
  const btCollisionObjectWrapper part(&whole, compound.getChildShape(child), whole.getCollisionObject(), world, local,
                                      -1, child);
  if (algorithm == nullptr) algorithm = find(part, other, result.m_closestPointDistanceThreshold);
  const bool is_first = result.getBody0Internal() == whole.getCollisionObject();
  const btCollisionObjectWrapper* const before = is_first ? result.getBody0Wrap() : result.getBody1Wrap();
  is_first ? result.setBody0Wrap(&part) : result.setBody1Wrap(&part);
  result.setShapeIdentifiersA(is_first ? -1 : other.m_partId, is_first ? child : other.m_index);
  result.setShapeIdentifiersB(is_first ? other.m_partId : -1, is_first ? other.m_index : child);
  algorithm->processCollision(&part, &other, info, &result);
  is_first ? result.setBody0Wrap(before) : result.setBody1Wrap(before);
}

}  // namespace

btCollisionAlgorithm* create_for_compounds(btCollisionAlgorithmConstructionInfo& info,
                                           const btCollisionObjectWrapper* first,
                                           const btCollisionObjectWrapper* second, LookAhead ahead) {
  if (has_shape(*first, *second)) return CompoundAlgorithm::create(*info.m_dispatcher1, ahead);
  btCollisionConfiguration& stock =
      *static_cast<btCollisionDispatcher*>(info.m_dispatcher1)->getCollisionConfiguration();
  const int types[] = {first->getCollisionShape()->getShapeType(), second->getCollisionShape()->getShapeType()};
  btCollisionAlgorithmCreateFunc* const create = ahead == LookAhead::yes
                                                     ? stock.getCollisionAlgorithmCreateFunc(types[0], types[1])
                                                     : stock.getClosestPointsAlgorithmCreateFunc(types[0], types[1]);
  return create->CreateCollisionAlgorithm(info, first, second);
}

}  // namespace vps::bullet
