// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/query_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>

#include "tests/bench/query_cache.h"
#include "tests/support/oracle.h"
#include "tests/support/random.h"

namespace vps::bench {
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

// The deepest vertex of a body in a copy of it: balls round groups of vertices, halved down to single ones.
class DeepestVertex {
 public:
  explicit DeepestVertex(const TriangleMesh& body) : oracle_(body), points_(body.vertices) {
    order_.resize(points_.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    build(0, order_.size());
  }
  [[nodiscard]] double depth(const Pose& first_in_second) const {
    double best = -std::numeric_limits<double>::max();
    visit(0, penetration(0, first_in_second), first_in_second, best);
    return best;
  }
  /// Of a ball round the origin that holds the body. [m]
  [[nodiscard]] double reach() const {
    double out = 0;
    for (const Point& p : points_) out = std::max(out, distance(p, {}));
    return out;
  }

 private:
  struct Ball {
    Point centre{};
    double radius = 0;
    std::size_t children[2] = {0, 0};  // 0: a single vertex
  };

  std::size_t build(std::size_t first, std::size_t last) {
    const std::size_t at = balls_.size();
    balls_.emplace_back();
    Point low = points_[order_[first]];
    Point high = low;
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], points_[order_[i]][axis]);
        high[axis] = std::max(high[axis], points_[order_[i]][axis]);
      }
    }
    Ball ball;
    std::size_t longest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      ball.centre[axis] = (low[axis] + high[axis]) / 2;
      if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
    }
    for (std::size_t i = first; i < last; ++i) {
      ball.radius = std::max(ball.radius, distance(ball.centre, points_[order_[i]]));
    }
    if (last - first > 1) {
      const std::size_t middle = (first + last) / 2;
      std::nth_element(order_.begin() + std::ptrdiff_t(first), order_.begin() + std::ptrdiff_t(middle),
                       order_.begin() + std::ptrdiff_t(last),
                       [&](std::size_t a, std::size_t b) { return points_[a][longest] < points_[b][longest]; });
      ball.children[0] = build(first, middle);
      ball.children[1] = build(middle, last);
    }
    balls_[at] = ball;
    return at;
  }

  [[nodiscard]] double penetration(std::size_t ball, const Pose& pose) const {
    return oracle_.penetration(moved(pose, balls_[ball].centre));
  }

  void visit(std::size_t at, double at_centre, const Pose& pose, double& best) const {
    const Ball& ball = balls_[at];
    if (at_centre + ball.radius <= best) return;
    if (ball.children[0] == 0) {
      best = at_centre;
      return;
    }
    std::pair<double, std::size_t> children[2];
    for (int i = 0; i < 2; ++i) children[i] = {penetration(ball.children[i], pose), ball.children[i]};
    if (children[0] < children[1]) std::swap(children[0], children[1]);
    for (const auto& [value, child] : children) visit(child, value, pose, best);
  }

  test::Oracle oracle_;
  std::vector<Point> points_;
  std::vector<std::size_t> order_;
  std::vector<Ball> balls_;
};

// One approach; false when it does not get there, or only by many steps because it grazes.
bool approach(const DeepestVertex& deepest, double wanted, test::Random& random, PairPose& out) {
  constexpr double kTolerance = 1e-7;
  constexpr int kSteps = 60;
  const std::array<double, 9> rotation = random.rotation();
  const std::array<double, 9> direction = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.first_in_second.rotation);
  double away = 2 * deepest.reach();
  for (int step = 0; step < kSteps && away > 0; ++step) {
    for (std::size_t i = 0; i < 3; ++i) out.first_in_second.translation[i] = away * direction[i];
    out.depth = deepest.depth(out.first_in_second);
    if (wanted - out.depth < kTolerance) return true;
    away -= wanted - out.depth;
  }
  return false;
}

std::vector<PairPose> compute(const TriangleMesh& body, const PoseOptions& options) {
  const DeepestVertex deepest(body);
  test::Random random;
  std::vector<PairPose> poses(options.count);
  for (std::size_t i = 0; i < options.count; ++i) {
    const double part = (double(i) + 0.5) / double(options.count);
    const double wanted = -options.apart + part * (options.apart + options.deep);
    while (!approach(deepest, wanted, random, poses[i])) {
    }
  }
  return poses;
}

}  // namespace

std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                 const std::filesystem::path& folder) {
  constexpr std::size_t kNumbers = 13;  // rotation, translation, depth
  const double key[] = {double(options.count), options.apart, options.deep};
  const std::filesystem::path file = cache_file(folder, "poses", body, key);
  if (const auto numbers = read_numbers(file)) {
    if (numbers->size() != options.count * kNumbers) throw std::runtime_error(file.string() + ": damaged; delete it");
    std::vector<PairPose> poses(options.count);
    const double* at = numbers->data();
    for (PairPose& pose : poses) {
      std::copy_n(at, 9, pose.first_in_second.rotation);
      std::copy_n(at + 9, 3, pose.first_in_second.translation);
      pose.depth = at[12];
      at += kNumbers;
    }
    return poses;
  }
  fmt::print(stderr, "query_bench: the oracle places {} poses, once: this takes a minute\n", options.count);
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

}  // namespace vps::bench
