// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/fcl.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/distance.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace vps::lab {
namespace {

using Model = fcl::BVHModel<fcl::OBBRSSd>;

// FCL takes triangles of less than about 1e-8 m^2 for degenerate, and calls them overlapping: it gets a larger body.
struct ScaledModel {
  Model model;
  double scale = 1;  // a power of two, so that nothing is rounded
};

// The scale at which the smallest triangle has an area of about 1 m^2. Slivers below rounding do not count.
double scale_of(const std::vector<fcl::Vector3d>& points, const std::vector<fcl::Triangle>& triangles) {
  double least = std::numeric_limits<double>::infinity();
  double longest = 0;  // of the squared sides
  for (const fcl::Triangle& t : triangles) {
    const fcl::Vector3d u = points[t[1]] - points[t[0]];
    const fcl::Vector3d v = points[t[2]] - points[t[0]];
    longest = std::max({longest, u.squaredNorm(), v.squaredNorm()});
    if (const double area = u.cross(v).norm(); area > 0) least = std::min(least, area);
  }
  const double area = std::max(least, 1e-24 * longest);
  return std::isfinite(area) && area > 0 ? std::exp2(std::round(-0.5 * std::log2(area))) : 1;
}

std::unique_ptr<ScaledModel> make_model(const TriangleMesh& body) {
  std::vector<fcl::Vector3d> points;
  for (const auto& v : body.vertices) points.emplace_back(v[0], v[1], v[2]);
  std::vector<fcl::Triangle> triangles;
  for (const auto& t : body.triangles) triangles.emplace_back(t[0], t[1], t[2]);
  auto out = std::make_unique<ScaledModel>();
  out->scale = scale_of(points, triangles);
  for (fcl::Vector3d& point : points) point *= out->scale;
  out->model.beginModel(int(triangles.size()), int(points.size()));
  out->model.addSubModel(points, triangles);
  out->model.endModel();
  return out;
}

// The pose of the first model in the second, of the same scale.
fcl::Transform3d transform(const Pose& pose, double scale) {
  fcl::Transform3d out = fcl::Transform3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) out.linear()(i, j) = pose.rotation[3 * i + j];
    out.translation()[i] = scale * pose.translation[i];
  }
  return out;
}

class Collide final : public PairPeer {
 public:
  explicit Collide(const TriangleMesh& body) : model_(make_model(body)) {}
  PairAnswer query(const Pose& first_in_second) override {
    const fcl::Transform3d first = transform(first_in_second, model_->scale);
    const fcl::Transform3d second = fcl::Transform3d::Identity();
    const auto begin = Clock::now();
    const fcl::CollisionRequestd request(std::numeric_limits<int>::max(), true);
    fcl::CollisionResultd result;
    fcl::collide(&model_->model, first, &model_->model, second, request, result);
    PairAnswer answer;
    answer.microseconds = microseconds_since(begin);
    answer.contacts = result.numContacts();
    if (answer.contacts == 0) return answer;
    answer.depth = 0;
    for (std::size_t i = 0; i < answer.contacts; ++i) {
      answer.depth = std::max(answer.depth, result.getContact(i).penetration_depth / model_->scale);
    }
    return answer;
  }

 private:
  std::unique_ptr<ScaledModel> model_;
};

class Distance final : public PairPeer {
 public:
  explicit Distance(const TriangleMesh& body) : model_(make_model(body)) {}
  PairAnswer query(const Pose& first_in_second) override {
    const fcl::Transform3d first = transform(first_in_second, model_->scale);
    const fcl::Transform3d second = fcl::Transform3d::Identity();
    const auto begin = Clock::now();
    const fcl::DistanceRequestd request;
    fcl::DistanceResultd result;
    const double distance = fcl::distance(&model_->model, first, &model_->model, second, request, result);
    PairAnswer answer;
    answer.microseconds = microseconds_since(begin);
    if (distance > 0) answer.depth = -distance / model_->scale;
    return answer;
  }

 private:
  std::unique_ptr<ScaledModel> model_;
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
  std::unique_ptr<ScaledModel> model;
};

LimitedDistance::LimitedDistance(const TriangleMesh& body) : impl_(new Impl{make_model(body)}) {}
LimitedDistance::~LimitedDistance() = default;

CountedDistance LimitedDistance::query(const Pose& first_in_second, std::size_t most_tests) const {
  const fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  LimitedNode node(most_tests);
  const auto& [model, scale] = *impl_->model;
  fcl::detail::initialize(node, model, transform(first_in_second, scale), model, fcl::Transform3d::Identity(), request,
                          result);
  fcl::detail::distance(&node);
  return {std::max(result.min_distance, 0.0) / scale, node.tests()};
}

std::unique_ptr<PairPeer> fcl_collide(const TriangleMesh& body) {
  return std::make_unique<Collide>(body);
}
std::unique_ptr<PairPeer> fcl_distance(const TriangleMesh& body) {
  return std::make_unique<Distance>(body);
}

}  // namespace vps::lab
