// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/evaluate/poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "cli/evaluate/fcl.h"
#include "cli/evaluate/numbers_file.h"
#include "cli/evaluate/oracle.h"
#include "cli/evaluate/random.h"

namespace vps::evaluate {
namespace {

using Point = std::array<double, 3>;

double distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

Point moved(const Pose& pose, const Point& p) {
  Point out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = pose.translation[i];
    for (std::size_t j = 0; j < 3; ++j) out[i] += pose.rotation[3 * i + j] * p[j];
  }
  return out;
}

Point between(const Point& a, const Point& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

// A triangle, and a ball round it.
struct Patch {
  std::array<Point, 3> corners{};
  Point centre{};
  double radius = 0;
  explicit Patch(const std::array<Point, 3>& c) : corners(c) {
    for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] = (c[0][axis] + c[1][axis] + c[2][axis]) / 3;
    for (const Point& corner : c) radius = std::max(radius, distance(centre, corner));
  }
  // Cut across the longest side, so that slivers lose their length first.
  [[nodiscard]] std::array<Patch, 2> halves() const {
    std::size_t at = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (side(i) > side(at)) at = i;
    }
    const Point& from = corners[at];
    const Point& to = corners[(at + 1) % 3];
    const Point& apex = corners[(at + 2) % 3];
    const Point middle = between(from, to);
    return {Patch({from, middle, apex}), Patch({middle, to, apex})};
  }

 private:
  [[nodiscard]] double side(std::size_t i) const { return distance(corners[i], corners[(i + 1) % 3]); }
};

// The deepest point of a body's surface in a copy of it: balls round groups of triangles, halved down to single ones,
// which are halved in turn.
class DeepestPoint {
 public:
  explicit DeepestPoint(const TriangleMesh& body) : oracle_(body), distance_(fcl_distance(body)) {
    for (const auto& [a, b, c] : body.triangles) {
      patches_.emplace_back(std::array<Point, 3>{body.vertices[a], body.vertices[b], body.vertices[c]});
    }
    build(0, patches_.size());
  }
  /// A depth that there is; the greatest is at most `tolerance` more. Bodies without a common point must not lie in
  /// each other. [m]
  [[nodiscard]] double depth(const Pose& first_in_second, double tolerance) const {
    if (const double apart = distance_->query(first_in_second).depth; apart < 0) return apart;
    Search search{first_in_second, tolerance};
    visit(0, penetration(balls_[0].centre, first_in_second), search);
    return search.best;
  }
  /// Radius of a ball round the origin that holds the body. [m]
  [[nodiscard]] double reach() const { return distance(balls_[0].centre, {}) + balls_[0].radius; }

 private:
  struct Ball {
    Point centre{};
    double radius = 0;
    std::size_t first = 0;             // patch, of a leaf
    std::size_t children[2] = {0, 0};  // 0: a leaf
  };

  struct Search {
    const Pose& pose;
    double tolerance = 0;
    double best = 0;  // at the surfaces' common points
    [[nodiscard]] bool worth(double bound) const { return bound > best + tolerance; }
  };

  std::size_t build(std::size_t first, std::size_t last) {
    const std::size_t at = balls_.size();
    balls_.emplace_back();
    Point low = patches_[first].centre;
    Point high = low;
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], patches_[i].centre[axis]);
        high[axis] = std::max(high[axis], patches_[i].centre[axis]);
      }
    }
    Ball ball;
    ball.first = first;
    ball.centre = between(low, high);
    for (std::size_t i = first; i < last; ++i) {
      ball.radius = std::max(ball.radius, distance(ball.centre, patches_[i].centre) + patches_[i].radius);
    }
    if (last - first > 1) {
      std::size_t longest = 0;
      for (std::size_t axis = 1; axis < 3; ++axis) {
        if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
      }
      const std::size_t middle = (first + last) / 2;
      std::nth_element(patches_.begin() + std::ptrdiff_t(first), patches_.begin() + std::ptrdiff_t(middle),
                       patches_.begin() + std::ptrdiff_t(last),
                       [longest](const Patch& a, const Patch& b) { return a.centre[longest] < b.centre[longest]; });
      ball.children[0] = build(first, middle);
      ball.children[1] = build(middle, last);
    }
    balls_[at] = ball;
    return at;
  }

  [[nodiscard]] double penetration(const Point& point, const Pose& pose) const {
    return oracle_.penetration(moved(pose, point));
  }

  [[nodiscard]] double depth_bound(const Patch& patch, const Pose& pose) const {
    const auto& [a, b, c] = patch.corners;
    return oracle_.depth_bound({moved(pose, a), moved(pose, b), moved(pose, c)});
  }

  void visit(std::size_t at, double at_centre, Search& search) const {
    const Ball& ball = balls_[at];
    if (!search.worth(at_centre + ball.radius)) return;
    if (ball.children[0] == 0) {
      const Patch& patch = patches_[ball.first];
      visit(patch, penetration(patch.centre, search.pose), search);
      return;
    }
    std::pair<double, std::size_t> children[2];
    for (int i = 0; i < 2; ++i) {
      children[i] = {penetration(balls_[ball.children[i]].centre, search.pose), ball.children[i]};
    }
    if (children[0] < children[1]) std::swap(children[0], children[1]);
    for (const auto& [value, child] : children) visit(child, value, search);
  }

  void visit(const Patch& patch, double at_centre, Search& search) const {
    search.best = std::max(search.best, at_centre);
    // Of flat faces the ball alone leaves far too much.
    if (!search.worth(at_centre + patch.radius) || !search.worth(depth_bound(patch, search.pose))) return;
    const std::array<Patch, 2> halves = patch.halves();
    const double values[2] = {penetration(halves[0].centre, search.pose), penetration(halves[1].centre, search.pose)};
    const std::size_t deeper = values[0] < values[1] ? 1 : 0;
    for (const std::size_t i : {deeper, 1 - deeper}) visit(halves[i], values[i], search);
  }

  Oracle oracle_;
  std::unique_ptr<PairPeer> distance_;
  std::vector<Patch> patches_;
  std::vector<Ball> balls_;
};

// One approach; false when it does not get there, or only by many steps because it grazes.
bool approach(const DeepestPoint& deepest, double wanted, double tolerance, Random& random, PairPose& out) {
  constexpr double kClose = 1e-6;
  constexpr int kSteps = 60;
  const std::array<double, 9> rotation = random.rotation();
  const std::array<double, 9> direction = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.first_in_second.rotation);
  double away = 2 * deepest.reach();
  for (int step = 0; step < kSteps && away > 0; ++step) {
    for (std::size_t i = 0; i < 3; ++i) out.first_in_second.translation[i] = away * direction[i];
    out.depth = deepest.depth(out.first_in_second, tolerance);
    const double lacking = wanted - out.depth;
    if (lacking < kClose) return true;
    away -= lacking;
  }
  return false;
}

std::vector<PairPose> compute(const TriangleMesh& body, const PoseOptions& options) {
  const DeepestPoint deepest(body);
  Random random;
  std::vector<PairPose> poses;
  for (const DepthRange& range : options.ranges) {
    for (std::size_t i = 0; i < range.count; ++i) {
      const double part = (double(i) + 0.5) / double(range.count);
      const double wanted = range.least + part * (range.most - range.least);
      PairPose& pose = poses.emplace_back();
      while (!approach(deepest, wanted, options.tolerance, random, pose)) {
      }
    }
  }
  return poses;
}

}  // namespace

std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                 const std::filesystem::path& folder) {
  constexpr std::size_t kNumbers = 13;  // rotation, translation, depth
  std::vector<double> key{options.tolerance};
  std::size_t count = 0;
  for (const DepthRange& range : options.ranges) {
    key.insert(key.end(), {double(range.count), range.least, range.most});
    count += range.count;
  }
  const std::filesystem::path file = cache_file(folder, "poses", body, key);
  if (const auto numbers = read_numbers(file)) {
    if (numbers->size() != count * kNumbers) throw std::runtime_error(file.string() + ": damaged; delete it");
    std::vector<PairPose> poses(count);
    const double* at = numbers->data();
    for (PairPose& pose : poses) {
      std::copy_n(at, 9, pose.first_in_second.rotation);
      std::copy_n(at + 9, 3, pose.first_in_second.translation);
      pose.depth = at[12];
      at += kNumbers;
    }
    return poses;
  }
  fmt::print(stderr, "The oracle places {} poses, once: this takes minutes\n", count);
  std::vector<PairPose> poses = compute(body, options);
  std::vector<double> numbers;
  for (const PairPose& pose : poses) {
    numbers.insert(numbers.end(), pose.first_in_second.rotation, pose.first_in_second.rotation + 9);
    numbers.insert(numbers.end(), pose.first_in_second.translation, pose.first_in_second.translation + 3);
    numbers.push_back(pose.depth);
  }
  write_numbers(file, numbers);
  return poses;
}

}  // namespace vps::evaluate
