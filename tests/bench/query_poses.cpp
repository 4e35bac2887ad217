// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/bench/query_poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
  [[nodiscard]] std::array<Patch, 4> quarters() const {
    const auto& [a, b, c] = corners;
    const Point ab = between(a, b);
    const Point bc = between(b, c);
    const Point ca = between(c, a);
    return {Patch({a, ab, ca}), Patch({ab, b, bc}), Patch({ca, bc, c}), Patch({bc, ca, ab})};
  }
};

// The deepest point of a body's surface in a copy of it: balls round groups of triangles, halved down to single ones,
// which are quartered in turn.
class DeepestPoint {
 public:
  explicit DeepestPoint(const TriangleMesh& body) : oracle_(body) {
    for (const auto& [a, b, c] : body.triangles) {
      patches_.emplace_back(std::array<Point, 3>{body.vertices[a], body.vertices[b], body.vertices[c]});
    }
    build(0, patches_.size());
  }
  /// A depth that there is; the greatest is at most `tolerance` more. [m]
  [[nodiscard]] double depth(const Pose& first_in_second, double tolerance) const {
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
    double best = -std::numeric_limits<double>::max();
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
    if (!search.worth(at_centre + patch.radius)) return;
    for (const Patch& quarter : patch.quarters()) visit(quarter, penetration(quarter.centre, search.pose), search);
  }

  test::Oracle oracle_;
  std::vector<Patch> patches_;
  std::vector<Ball> balls_;
};

// One approach; false when it does not get there, or only by many steps because it grazes.
bool approach(const DeepestPoint& deepest, double wanted, test::Random& random, PairPose& out) {
  constexpr double kClose = 1e-6;
  constexpr double kRough = 1e-4;
  constexpr int kSteps = 60;
  const std::array<double, 9> rotation = random.rotation();
  const std::array<double, 9> direction = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.first_in_second.rotation);
  double away = 2 * deepest.reach();
  // Far off, a rough answer will do, taken for deeper than it is.
  double tolerance = kRough;
  for (int step = 0; step < kSteps && away > 0; ++step) {
    for (std::size_t i = 0; i < 3; ++i) out.first_in_second.translation[i] = away * direction[i];
    out.depth = deepest.depth(out.first_in_second, tolerance);
    const double lacking = wanted - out.depth - (tolerance == kRough ? kRough : 0);
    if (lacking >= kClose) {
      away -= lacking;
    } else if (tolerance == kRough) {
      tolerance = kDepthTolerance;
    } else {
      return true;
    }
  }
  return false;
}

std::vector<PairPose> compute(const TriangleMesh& body, const PoseOptions& options) {
  const DeepestPoint deepest(body);
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
  const double key[] = {double(options.count), options.apart, options.deep, kDepthTolerance};
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
  fmt::print(stderr, "query_bench: the oracle places {} poses, once: this takes minutes\n", options.count);
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
