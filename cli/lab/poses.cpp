// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/poses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "cli/lab/fcl.h"
#include "cli/lab/numbers_file.h"
#include "cli/lab/oracle.h"
#include "cli/lab/patches.h"
#include "cli/lab/random.h"

namespace vps::lab {
namespace {

// Finds the deepest point of a body's surface in a copy of the body: a search down a tree of balls to single triangles,
// which are halved further.
class DeepestPoint {
 public:
  /// @param most_work  of PoseOptions
  DeepestPoint(const TriangleMesh& body, std::size_t most_work)
      : oracle_(body), distance_(body), tree_(body), most_work_(most_work) {}
  /// The depth of a point of the surface; the greatest depth is at most `tolerance` more. Neither body may lie inside
  /// the other without a common point of their surfaces. [m]
  [[nodiscard]] double depth(const Pose& first_in_second, double tolerance) {
    if (const double apart = distance(first_in_second); apart > 0) return -apart;
    Search search{first_in_second, tolerance};
    visit(0, penetration(tree_.ball(0).centre, first_in_second), search);
    return search.best;
  }
  /// Resets the count of work for the next pose.
  void start() { work_ = 0; }
  /// Whether the work is used up: the last `depth` may then be too small.
  [[nodiscard]] bool exhausted() const { return most_work_ > 0 && work_ >= most_work_; }
  /// Radius of a ball round the origin that holds the body. [m]
  [[nodiscard]] double reach() const { return lab::distance(tree_.ball(0).centre, {}) + tree_.ball(0).radius; }

 private:
  struct Search {
    const Pose& pose;
    double tolerance = 0;
    double best = 0;  // the depth at the surfaces' common points
    [[nodiscard]] bool worth(double bound) const { return bound > best + tolerance; }
  };

  // Too large when it uses up the work. [m]
  [[nodiscard]] double distance(const Pose& first_in_second) {
    constexpr std::size_t kLeast = 1000;  // points that take as long as a usual query
    constexpr std::size_t kTests = 50;    // tests of boxes that take as long as a point
    const std::size_t left = most_work_ > work_ ? most_work_ - work_ : 1;
    const std::size_t most_tests = most_work_ > 0 ? kTests * left : std::numeric_limits<std::size_t>::max();
    const CountedDistance answer = distance_.query(first_in_second, most_tests);
    work_ += std::max(kLeast, answer.tests / kTests);
    return answer.distance;
  }

  [[nodiscard]] double penetration(const Point& point, const Pose& pose) {
    ++work_;
    return oracle_.penetration(moved(pose, point));
  }

  [[nodiscard]] double depth_bound(const Patch& patch, const Pose& pose) {
    ++work_;
    const auto& [a, b, c] = patch.corners;
    return oracle_.depth_bound({moved(pose, a), moved(pose, b), moved(pose, c)});
  }

  void visit(std::size_t at, double at_centre, Search& search) {
    const PatchTree::Ball& ball = tree_.ball(at);
    if (exhausted() || !search.worth(at_centre + ball.radius)) return;
    if (ball.children[0] == 0) {
      const Patch& patch = tree_.patch(ball);
      visit(patch, penetration(patch.centre, search.pose), search);
      return;
    }
    std::pair<double, std::size_t> children[2];
    for (int i = 0; i < 2; ++i) {
      children[i] = {penetration(tree_.ball(ball.children[i]).centre, search.pose), ball.children[i]};
    }
    if (children[0] < children[1]) std::swap(children[0], children[1]);
    for (const auto& [value, child] : children) visit(child, value, search);
  }

  void visit(const Patch& patch, double at_centre, Search& search) {
    search.best = std::max(search.best, at_centre);
    if (exhausted()) return;
    // The ball alone gives a far too large bound for flat faces.
    if (!search.worth(at_centre + patch.radius) || !search.worth(depth_bound(patch, search.pose))) return;
    const std::array<Patch, 2> halves = patch.halves();
    const double values[2] = {penetration(halves[0].centre, search.pose), penetration(halves[1].centre, search.pose)};
    const std::size_t deeper = values[0] < values[1] ? 1 : 0;
    for (const std::size_t i : {deeper, 1 - deeper}) visit(halves[i], values[i], search);
  }

  Oracle oracle_;
  LimitedDistance distance_;
  PatchTree tree_;
  const std::size_t most_work_;
  std::size_t work_ = 0;
};

// Tries one approach. Returns false when it does not reach the depth, or not within `kSteps`, as where it grazes.
bool approach(DeepestPoint& deepest, double wanted, const PoseOptions& options, Random& random, PairPose& out) {
  constexpr int kSteps = 60;
  const std::array<double, 9> rotation = random.rotation();
  const std::array<double, 9> direction = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.first_in_second.rotation);
  double away = 2 * deepest.reach();
  for (int step = 0; step < kSteps && away > 0; ++step) {
    for (std::size_t i = 0; i < 3; ++i) out.first_in_second.translation[i] = away * direction[i];
    out.depth = deepest.depth(out.first_in_second, options.tolerance);
    if (deepest.exhausted()) return false;
    const double lacking = wanted - out.depth;
    if (lacking < options.arrival) return true;
    away -= lacking;
  }
  return false;
}

// Tries approaches until one reaches the depth; false when none does.
bool place(DeepestPoint& deepest, double wanted, const PoseOptions& options, Random& random, PairPose& out) {
  constexpr int kApproaches = 200;
  deepest.start();
  for (int i = 0; i < kApproaches && !deepest.exhausted(); ++i) {
    if (approach(deepest, wanted, options, random, out)) return true;
  }
  return false;
}

// The middle of one of `count` equal parts of the range. [m]
double wanted_depth(const DepthRange& range, std::size_t i, std::size_t count) {
  return range.least + (double(i) + 0.5) / double(count) * (range.most - range.least);
}

// Whether one of a few poses spread over the range is found. Where none is, the search for the ranges before it would
// be in vain. The random numbers are its own, so that it changes no pose.
bool is_reached(DeepestPoint& deepest, const DepthRange& range, const PoseOptions& options) {
  constexpr std::size_t kTrials = 3;
  Random random(options.seed);
  PairPose pose;
  for (std::size_t i = 0; i < kTrials; ++i) {
    if (place(deepest, wanted_depth(range, i, kTrials), options, random, pose)) return true;
  }
  return false;
}

std::vector<PairPose> compute(const TriangleMesh& body, const PoseOptions& options) {
  constexpr int kInARow = 5;  // after so many poses left out in a row, the rest of the range is left out
  DeepestPoint deepest(body, options.most_work);
  if (options.essential < options.ranges.size() && options.most_work > 0) {
    const DepthRange& range = options.ranges[options.essential];
    if (range.count > 0 && !is_reached(deepest, range, options)) return {};
  }
  Random random(options.seed);
  std::vector<PairPose> poses;
  std::size_t asked = 0;
  for (std::size_t r = 0; r < options.ranges.size(); ++r) {
    const DepthRange& range = options.ranges[r];
    const std::size_t before = poses.size();
    int failed = 0;
    for (std::size_t i = 0; i < range.count && failed < kInARow; ++i) {
      const double wanted = wanted_depth(range, i, range.count);
      PairPose pose;
      pose.range = r;
      if (place(deepest, wanted, options, random, pose)) {
        poses.push_back(pose);
        failed = 0;
      } else if (options.most_work == 0) {
        throw MeasureError(
            fmt::format("no approach of the body to its copy gets {:.4g} m deep; its walls may be too thin", wanted));
      } else {
        ++failed;
      }
      if (options.progress) options.progress(++asked);
    }
    if (range.count > 0 && poses.size() == before) break;  // deeper poses would not be found either
  }
  return poses;
}

}  // namespace

std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                 const std::filesystem::path& folder) {
  constexpr std::size_t kNumbers = 14;  // rotation, translation, depth, range
  constexpr double kSearch = 2;         // increased when the same options give other poses
  std::vector<double> key{
      options.tolerance, options.arrival, double(options.seed), double(options.most_work), double(options.essential),
      double(kNumbers),  kSearch};
  std::size_t count = 0;
  for (const DepthRange& range : options.ranges) {
    key.insert(key.end(), {double(range.count), range.least, range.most});
    count += range.count;
  }
  const std::filesystem::path file = cache_file(folder, "poses", body, key);
  if (const auto numbers = read_numbers(file)) {
    if (numbers->size() % kNumbers != 0 || numbers->size() > count * kNumbers)
      throw MeasureError(file.string() + " is damaged; delete it");
    std::vector<PairPose> poses(numbers->size() / kNumbers);
    const double* at = numbers->data();
    for (PairPose& pose : poses) {
      std::copy_n(at, 9, pose.first_in_second.rotation);
      std::copy_n(at + 9, 3, pose.first_in_second.translation);
      pose.depth = at[12];
      pose.range = static_cast<std::size_t>(at[13]);
      at += kNumbers;
    }
    return poses;
  }
  std::vector<PairPose> poses = compute(body, options);
  std::vector<double> numbers;
  for (const PairPose& pose : poses) {
    numbers.insert(numbers.end(), pose.first_in_second.rotation, pose.first_in_second.rotation + 9);
    numbers.insert(numbers.end(), pose.first_in_second.translation, pose.first_in_second.translation + 3);
    numbers.insert(numbers.end(), {pose.depth, double(pose.range)});
  }
  write_numbers(file, numbers);
  return poses;
}

}  // namespace vps::lab
