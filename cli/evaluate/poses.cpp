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
#include "cli/evaluate/patches.h"
#include "cli/evaluate/random.h"

namespace vps::evaluate {
namespace {

// The deepest point of a body's surface in a copy of it: balls round groups of triangles, halved down to single ones,
// which are halved in turn.
class DeepestPoint {
 public:
  explicit DeepestPoint(const TriangleMesh& body) : oracle_(body), distance_(fcl_distance(body)), tree_(body) {}
  /// A depth that there is; the greatest is at most `tolerance` more. Bodies without a common point must not lie in
  /// each other. [m]
  [[nodiscard]] double depth(const Pose& first_in_second, double tolerance) const {
    if (const double apart = distance_->query(first_in_second).depth; apart < 0) return apart;
    Search search{first_in_second, tolerance};
    visit(0, penetration(tree_.ball(0).centre, first_in_second), search);
    return search.best;
  }
  /// Radius of a ball round the origin that holds the body. [m]
  [[nodiscard]] double reach() const { return distance(tree_.ball(0).centre, {}) + tree_.ball(0).radius; }

 private:
  struct Search {
    const Pose& pose;
    double tolerance = 0;
    double best = 0;  // at the surfaces' common points
    [[nodiscard]] bool worth(double bound) const { return bound > best + tolerance; }
  };

  [[nodiscard]] double penetration(const Point& point, const Pose& pose) const {
    return oracle_.penetration(moved(pose, point));
  }

  [[nodiscard]] double depth_bound(const Patch& patch, const Pose& pose) const {
    const auto& [a, b, c] = patch.corners;
    return oracle_.depth_bound({moved(pose, a), moved(pose, b), moved(pose, c)});
  }

  void visit(std::size_t at, double at_centre, Search& search) const {
    const PatchTree::Ball& ball = tree_.ball(at);
    if (!search.worth(at_centre + ball.radius)) return;
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
  PatchTree tree_;
};

// One approach; false when it does not get there, or only by many steps because it grazes.
bool approach(const DeepestPoint& deepest, double wanted, const PoseOptions& options, Random& random, PairPose& out) {
  constexpr int kSteps = 60;
  const std::array<double, 9> rotation = random.rotation();
  const std::array<double, 9> direction = random.rotation();
  std::copy(rotation.begin(), rotation.end(), out.first_in_second.rotation);
  double away = 2 * deepest.reach();
  for (int step = 0; step < kSteps && away > 0; ++step) {
    for (std::size_t i = 0; i < 3; ++i) out.first_in_second.translation[i] = away * direction[i];
    out.depth = deepest.depth(out.first_in_second, options.tolerance);
    const double lacking = wanted - out.depth;
    if (lacking < options.arrival) return true;
    away -= lacking;
  }
  return false;
}

std::vector<PairPose> compute(const TriangleMesh& body, const PoseOptions& options) {
  constexpr int kApproaches = 200;
  const DeepestPoint deepest(body);
  Random random(options.seed);
  std::vector<PairPose> poses;
  for (const DepthRange& range : options.ranges) {
    for (std::size_t i = 0; i < range.count; ++i) {
      const double part = (double(i) + 0.5) / double(range.count);
      const double wanted = range.least + part * (range.most - range.least);
      PairPose& pose = poses.emplace_back();
      int tried = 0;
      while (!approach(deepest, wanted, options, random, pose)) {
        if (++tried < kApproaches) continue;
        throw MeasureError(
            fmt::format("no approach of the body to its copy gets {:.4g} m deep; its walls may be too thin", wanted));
      }
      if (options.progress) options.progress(poses.size());
    }
  }
  return poses;
}

}  // namespace

std::vector<PairPose> pair_poses(const TriangleMesh& body, const PoseOptions& options,
                                 const std::filesystem::path& folder) {
  constexpr std::size_t kNumbers = 13;  // rotation, translation, depth
  std::vector<double> key{options.tolerance, options.arrival, double(options.seed)};
  std::size_t count = 0;
  for (const DepthRange& range : options.ranges) {
    key.insert(key.end(), {double(range.count), range.least, range.most});
    count += range.count;
  }
  const std::filesystem::path file = cache_file(folder, "poses", body, key);
  if (const auto numbers = read_numbers(file)) {
    if (numbers->size() != count * kNumbers) throw MeasureError(file.string() + " is damaged; delete it");
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
  if (!options.progress) fmt::print(stderr, "The oracle places {} poses, once: this takes minutes\n", count);
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
