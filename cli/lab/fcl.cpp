// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/fcl.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace vps::lab {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;

std::unique_ptr<Model> make_model(const TriangleMesh& body) {
  std::vector<fcl::Vector3d> points;
  for (const auto& v : body.vertices) points.emplace_back(v[0], v[1], v[2]);
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : body.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  auto model = std::make_unique<Model>();
  model->beginModel(int(triangles.size()), int(points.size()));
  model->addSubModel(points, triangles);
  model->endModel();
  return model;
}

fcl::Transform3d transform(const Pose& pose) {
  fcl::Transform3d out = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[3 * i + j];
    out.translation()[i] = pose.translation[i];
  }
  return out;
}

class Collide final : public PairPeer {
 public:
  explicit Collide(const TriangleMesh& body) : model_(make_model(body)) {}
  PairAnswer query(const Pose& first_in_second) override {
    const fcl::Transform3d first = transform(first_in_second);
    const fcl::Transform3d second = fcl::Transform3d::Identity();
    const auto begin = Clock::now();
    const fcl::CollisionRequestd request(std::numeric_limits<int>::max(), true);
    fcl::CollisionResultd result;
    fcl::collide(model_.get(), first, model_.get(), second, request, result);
    PairAnswer answer;
    answer.microseconds = microseconds_since(begin);
    answer.contacts = result.numContacts();
    if (answer.contacts == 0) return answer;
    answer.depth = 0;
    for (std::size_t i = 0; i < answer.contacts; ++i) {
      answer.depth = std::max(answer.depth, result.getContact(i).penetration_depth);
    }
    return answer;
  }

 private:
  std::unique_ptr<Model> model_;
};

class Distance final : public PairPeer {
 public:
  explicit Distance(const TriangleMesh& body) : model_(make_model(body)) {}
  PairAnswer query(const Pose& first_in_second) override {
    const fcl::Transform3d first = transform(first_in_second);
    const fcl::Transform3d second = fcl::Transform3d::Identity();
    const auto begin = Clock::now();
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    const double distance = fcl::distance(model_.get(), first, model_.get(), second, request, result);
    PairAnswer answer;
    answer.microseconds = microseconds_since(begin);
    if (distance > 0) answer.depth = -distance;
    return answer;
  }

 private:
  std::unique_ptr<Model> model_;
};

// FCL's own traversal, which also counts its tests and ends at a limit.
using Node = fcl::detail::MeshDistanceTraversalNodeOBBRSSd;

class LimitedNode final : public Node {
 public:
  explicit LimitedNode(std::size_t most_tests) : most_tests_(most_tests) {}
  double BVTesting(int first, int second) const override {
    ++tests_;
    return Node::BVTesting(first, second);
  }
  bool canStop(double bound) const override { return tests_ >= most_tests_ || Node::canStop(bound); }
  [[nodiscard]] std::size_t tests() const { return tests_; }

 private:
  const std::size_t most_tests_;
  mutable std::size_t tests_ = 0;  // FCL's interface is const
};

}  // namespace

struct LimitedDistance::Impl {
  std::unique_ptr<Model> model;
};

LimitedDistance::LimitedDistance(const TriangleMesh& body) : impl_(new Impl{make_model(body)}) {}
LimitedDistance::~LimitedDistance() = default;

CountedDistance LimitedDistance::query(const Pose& first_in_second, std::size_t most_tests) const {
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  LimitedNode node(most_tests);
  const Model& model = *impl_->model;
  fcl::detail::initialize(node, model, transform(first_in_second), model, fcl::Transform3d::Identity(), request,
                          result);
  fcl::detail::distance(&node);
  return {std::max(result.min_distance, 0.0), node.tests()};
}

std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body) {
  return std::make_unique<Collide>(body);
}
std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body) {
  return std::make_unique<Distance>(body);
}

}  // namespace vps::lab
