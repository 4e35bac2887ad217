// SPDX-License-Identifier: GPL-3.0-or-later
// Processes the algorithm's pairs on several threads, as btCollisionDispatcherMt does. Debian builds Bullet without
// threads.
#include <BulletCollision/CollisionDispatch/btCollisionObjectWrapper.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>
#include <btBulletCollisionCommon.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <deque>
#include <memory>
#include <mutex>
#include <vector>

#include "runtime/bullet/vps_bullet.h"
#include "tests/support/random.h"
#include "tests/threads/threads.h"

namespace vps::test {
namespace {

constexpr std::size_t kBodies = 60;
constexpr int kSteps = 12;

// Pairs request manifolds while they are processed. In Bullet's own dispatcher only one thread may do so at a time.
class LockingDispatcher final : public btCollisionDispatcher {
 public:
  using btCollisionDispatcher::btCollisionDispatcher;
  btPersistentManifold* getNewManifold(const btCollisionObject* first, const btCollisionObject* second) override {
    const std::lock_guard lock(mutex_);
    return btCollisionDispatcher::getNewManifold(first, second);
  }
  void releaseManifold(btPersistentManifold* manifold) override {
    const std::lock_guard lock(mutex_);
    btCollisionDispatcher::releaseManifold(manifold);
  }

 private:
  std::mutex mutex_;
};

std::shared_ptr<const Asset> gear() {
  auto asset = std::make_shared<Asset>();
  EXPECT_EQ(Asset::open(asset_path, *asset), Status::ok);
  return asset;
}

// GImpact counts its readers without a lock, where the sanitizer does not look. It sees this count.
struct CountingMesh final : btGImpactMeshShape {
  using btGImpactMeshShape::btGImpactMeshShape;
  void processAllTriangles(btTriangleCallback* callback, const btVector3& low, const btVector3& high) const override {
    ++count;
    btGImpactMeshShape::processAllTriangles(callback, low, high);
  }
  mutable int count = 0;
};

// Shapes that bodies share; the baked ones share one asset.
struct Shapes {
  std::shared_ptr<const Asset> asset = gear();
  bullet::Shape plain{asset}, segmented{asset}, springy{asset};
  btBoxShape box{btVector3(btScalar(0.01), btScalar(0.015), btScalar(0.02))};
  btSphereShape sphere{btScalar(0.015)};
  btCylinderShape cylinder{btVector3(btScalar(0.01), btScalar(0.02), btScalar(0.01))};
  btConvexHullShape hull;
  btStaticPlaneShape plane{{0, 0, 1}, 0};
  btTriangleMesh triangles;
  std::unique_ptr<btBvhTriangleMeshShape> mesh;
  std::unique_ptr<CountingMesh> gimpact;

  Shapes() {
    segmented.set_segments(15);
    EXPECT_EQ(springy.set_foundation({1e9, 1e3}), Status::ok);
    Random random;
    const auto coordinate = [&] { return btScalar(random.between(-0.015, 0.015)); };
    for (int i = 0; i < 20; ++i) hull.addPoint({coordinate(), coordinate(), coordinate()});
    hull.setMargin(btScalar(0.0005));
    for (int i = 0; i < 40; ++i) {
      const btVector3 corner(coordinate(), coordinate(), coordinate());
      triangles.addTriangle(corner, {coordinate(), coordinate(), coordinate()}, -corner);
    }
    mesh = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
    gimpact = std::make_unique<CountingMesh>(&triangles);
    gimpact->updateBound();
  }
  // Every other shape is baked, so that the algorithm handles every pair of neighbours.
  btCollisionShape* of_body(std::size_t i) {
    btCollisionShape* const ours[] = {&plain, &segmented, &springy};
    btCollisionShape* const any[] = {&box,      &plain, &sphere,    &hull,        &segmented,
                                     &cylinder, &plane, mesh.get(), gimpact.get()};
    return i % 2 == 0 ? ours[i / 2 % 3] : any[i / 2 % 9];
  }
};

// Two bodies with their algorithm, created before any thread starts.
class Pair {
 public:
  Pair(btCollisionDispatcher& dispatcher, const btCollisionObject& first, const btCollisionObject& second)
      : dispatcher_(dispatcher), first_(first), second_(second) {
    const auto a = wrap(first_);
    const auto b = wrap(second_);
    algorithm_ = dispatcher_.findAlgorithm(&a, &b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;
  ~Pair() {
    algorithm_->~btCollisionAlgorithm();
    dispatcher_.freeCollisionAlgorithm(algorithm_);
  }

  void process() {
    const auto a = wrap(first_);
    const auto b = wrap(second_);
    btManifoldResult result(&a, &b);
    algorithm_->processCollision(&a, &b, btDispatcherInfo(), &result);
  }
  void append_contacts(std::vector<btScalar>& out) {
    btManifoldArray manifolds;
    algorithm_->getAllContactManifolds(manifolds);
    const auto keep = [&](const btVector3& v) { out.insert(out.end(), {v.x(), v.y(), v.z()}); };
    for (int m = 0; m < manifolds.size(); ++m) {
      for (int i = 0; i < manifolds[m]->getNumContacts(); ++i) {
        btManifoldPoint& point = manifolds[m]->getContactPoint(i);
        keep(point.m_localPointA);
        keep(point.m_localPointB);
        keep(point.m_positionWorldOnA);
        keep(point.m_positionWorldOnB);
        keep(point.m_normalWorldOnB);
        out.insert(out.end(), {point.m_distance1, btScalar(point.m_index0), btScalar(point.m_lifeTime),
                               point.m_appliedImpulse, point.m_combinedContactStiffness1});
        point.m_appliedImpulse += 1;  // instead of a solver; must be carried over
      }
    }
  }

 private:
  static btCollisionObjectWrapper wrap(const btCollisionObject& object) {
    return {nullptr, object.getCollisionShape(), &object, object.getWorldTransform(), -1, -1};
  }
  btCollisionDispatcher& dispatcher_;
  const btCollisionObject& first_;
  const btCollisionObject& second_;
  btCollisionAlgorithm* algorithm_ = nullptr;
};

// A row of bodies that overlap their neighbours.
class Row {
 public:
  Row() {
    bullet::register_algorithm(dispatcher_);
    for (std::size_t i = 0; i < kBodies; ++i) {
      bodies_[i].setCollisionShape(shapes_.of_body(i));
      place(i, 0.02 * static_cast<double>(i));
    }
    for (std::size_t i = 1; i < kBodies; ++i) pairs_.emplace_back(dispatcher_, bodies_[i - 1], bodies_[i]);
  }

  // All contacts after each step.
  std::vector<std::vector<btScalar>> run(std::size_t workers) {
    std::vector<std::vector<btScalar>> out(kSteps);
    for (int step = 0; step < kSteps; ++step) {
      deal_out(pairs_.size(), workers, [&](std::size_t i) { pairs_[i].process(); });
      for (Pair& pair : pairs_) pair.append_contacts(out[static_cast<std::size_t>(step)]);
      for (std::size_t i = 0; i < kBodies; ++i) move(i, step);
    }
    return out;
  }

 private:
  void place(std::size_t i, double x) {
    const auto r = random_.rotation();
    const auto at = [&](std::size_t k) { return btScalar(r[k]); };
    bodies_[i].setWorldTransform(btTransform({at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), at(8)},
                                             {btScalar(x), 0, btScalar(random_.between(-0.01, 0.01))}));
  }
  // Most bodies move little, so that the pairs' memory is used; some jump.
  void move(std::size_t i, int step) {
    btTransform at = bodies_[i].getWorldTransform();
    if ((i + static_cast<std::size_t>(step)) % 7 == 0) return place(i, 0.02 * static_cast<double>(i));
    const auto little = [&] { return btScalar(random_.between(-1e-4, 1e-4)); };
    at.setOrigin(at.getOrigin() + btVector3(little(), little(), little()));
    bodies_[i].setWorldTransform(at);
  }

  Shapes shapes_;
  Random random_;
  btDefaultCollisionConfiguration configuration_;
  LockingDispatcher dispatcher_{&configuration_};
  std::array<btCollisionObject, kBodies> bodies_;
  std::deque<Pair> pairs_;
};

std::atomic<int> lines{0};

// This test must run first: a Shape remembers its first query only until a dispatcher of the program is registered.
// Each thread queries a shape once, as a second call of the same thread could order the accesses of its first.
TEST(Threads, BoundsThatManyThreadsAskForAreThoseOfOneThread) {
  lines = 0;
  bullet::set_message_handler([](const char*) { ++lines; });
  const auto asset = gear();
  std::array<btVector3, kThreads> low;
  std::array<btVector3, kThreads> high;
  const auto ask_at_once = [&](const bullet::Shape& shape, btScalar apart) {
    deal_out(kThreads, kThreads, [&](std::size_t i) {
      shape.getAabb(btTransform(btQuaternion::getIdentity(), {apart * btScalar(i), 0, 0}), low[i], high[i]);
    });
  };
  const bullet::Shape moved(asset);
  ask_at_once(moved, 1);
  EXPECT_EQ(lines, 0);
  for (std::size_t i = 0; i < kThreads; ++i) {
    EXPECT_NEAR(low[i].x() - low[0].x(), btScalar(i), 1e-5) << i;
    EXPECT_NEAR(high[i].x() - high[0].x(), btScalar(i), 1e-5) << i;
  }
  // All threads but one query a transform that was queried before.
  const bullet::Shape at_rest(asset);
  ask_at_once(at_rest, 0);
  bullet::set_message_handler(nullptr);
  EXPECT_EQ(lines, 1);
}

TEST(Threads, PairsOfAWorldAnswerAsOneThreadDoes) {
  const auto many = Row().run(kThreads);
  const auto one = Row().run(1);
  for (std::size_t step = 0; step < kSteps; ++step) {
    EXPECT_GT(one[step].size(), 20 * kBodies) << "step " << step;  // about one contact per pair
    EXPECT_TRUE(many[step] == one[step]) << "step " << step;
  }
}

TEST(Threads, WhatManyPairsMeetIsToldOnce) {
  lines = 0;
  bullet::set_message_handler([](const char*) { ++lines; });
  const bullet::Shape shape(gear());
  deal_out(64, kThreads, [&](std::size_t i) { shape.report(i % 2 == 0 ? Status::bad_pose : Status::missing_part); });
  bullet::set_message_handler(nullptr);
  EXPECT_EQ(lines, 2);
  EXPECT_NE(shape.status(), Status::ok);
}

}  // namespace
}  // namespace vps::test
