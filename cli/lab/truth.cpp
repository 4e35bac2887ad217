// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/lab/truth.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <numeric>

#include "bake/extent.h"
#include "cli/lab/numbers_file.h"

namespace vps::lab {
namespace {

using Progress = std::function<void(const char* what, double fraction)>;

constexpr std::size_t kNumbers = 9;  // force, torque, pressure, area, error

std::vector<double> to_numbers(const std::vector<TruePose>& poses) {
  std::vector<double> numbers;
  for (const TruePose& p : poses) {
    numbers.insert(numbers.end(), p.wrench.force.begin(), p.wrench.force.end());
    numbers.insert(numbers.end(), p.wrench.torque.begin(), p.wrench.torque.end());
    numbers.insert(numbers.end(), {p.wrench.pressure, p.wrench.area, p.wrench.error});
  }
  return numbers;
}

void from_numbers(const std::vector<double>& numbers, std::vector<TruePose>& poses) {
  const double* at = numbers.data();
  for (TruePose& p : poses) {
    std::copy_n(at, 3, p.wrench.force.begin());
    std::copy_n(at + 3, 3, p.wrench.torque.begin());
    p.wrench.pressure = at[6];
    p.wrench.area = at[7];
    p.wrench.error = at[8];
    at += kNumbers;
  }
}

void integrate(const TriangleMesh& body, GroundTruth& truth, const Progress& progress) {
  const WrenchOracle oracle(body, body, truth.options.wrench);
  std::atomic<std::size_t> done = 0;
  tbb::parallel_for(std::size_t{0}, truth.poses.size(), [&](std::size_t i) {
    TruePose& pose = truth.poses[i];
    if (pose.range != PoseKind::apart) pose.wrench = oracle.at(pose.pose.first_in_second);
    if (progress) progress("forces", double(++done) / double(truth.poses.size()));
  });
}

void add_wrenches(const TriangleMesh& body, GroundTruth& truth, const std::filesystem::path& folder,
                  const Progress& progress) {
  // The file's key has the poses themselves.
  std::vector<double> key{truth.options.wrench.tolerance, truth.options.wrench.widest,
                          double(truth.options.wrench.most_pieces)};
  for (const TruePose& p : truth.poses) {
    const Pose& pose = p.pose.first_in_second;
    key.insert(key.end(), pose.rotation, pose.rotation + 9);
    key.insert(key.end(), pose.translation, pose.translation + 3);
  }
  const std::filesystem::path file = cache_file(folder, "wrenches", body, key);
  if (const auto numbers = read_numbers(file)) {
    if (numbers->size() != truth.poses.size() * kNumbers) throw MeasureError(file.string() + " is damaged; delete it");
    from_numbers(*numbers, truth.poses);
    return;
  }
  integrate(body, truth, progress);
  write_numbers(file, to_numbers(truth.poses));
}

// A tenth of the distance between the depths that are sought next to each other: a range is as evenly covered, and the
// last small steps of an approach are saved, each of which may take tens of thousands of points. [m]
double arrival_of(const TruthOptions& options) {
  const double ranges[] = {options.gap, options.contact, options.deep - options.contact};
  double arrival = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    if (options.poses[i] > 0) arrival = std::min(arrival, 0.1 * ranges[i] / double(options.poses[i]));
  }
  return std::max(arrival, 0.1 * options.tolerance);
}

}  // namespace

TruthOptions truth_options_for(const TriangleMesh& body, std::size_t poses) {
  const bake::Extent extent = bake::measure_extent(body);
  const double longest = (extent.bounds_max - extent.bounds_min).maxCoeff();
  const double thick = 2 * extent.volume / extent.area;  // of a plate
  TruthOptions options;
  for (std::size_t i = 0; i < 3; ++i) options.poses[i] = (poses + 2 - i) / 3;
  options.gap = longest / 200;
  options.contact = std::min(longest / 200, thick / 16);
  options.deep = std::min(longest / 50, thick / 4);
  options.tolerance = 1e-5 * longest;
  return options;
}

GroundTruth find_truth(const TriangleMesh& body, const TruthOptions& options, Wrenches wrenches,
                       const std::filesystem::path& folder) {
  GroundTruth truth;
  truth.options = options;
  truth.options.progress = nullptr;
  truth.oracle = std::make_shared<const Oracle>(body);
  PoseOptions pose_options;
  pose_options.ranges = {{options.poses[0], -options.gap, 0},
                         {options.poses[1], 0, options.contact},
                         {options.poses[2], options.contact, options.deep}};
  pose_options.tolerance = options.tolerance;
  pose_options.arrival = arrival_of(options);
  pose_options.seed = options.seed;
  pose_options.most_work = options.most_work;
  pose_options.essential = std::size_t(PoseKind::contact);
  const double count = double(options.poses[0] + options.poses[1] + options.poses[2]);
  pose_options.progress = [&](std::size_t placed) {
    if (options.progress) options.progress("poses", double(placed) / count);
  };
  for (const PairPose& pose : pair_poses(body, pose_options, folder)) {
    truth.poses.push_back({pose, PoseKind(pose.range), {}});
    ++truth.found[pose.range];
  }
  if (options.poses[std::size_t(PoseKind::contact)] > 0 && truth.found[std::size_t(PoseKind::contact)] == 0) {
    throw MeasureError(
        "no pose of contact with a copy was found; the walls may be too thin, or too many triangles touch: measure its "
        "parts one by one, or thicken it with --repair wrap");
  }
  if (wrenches == Wrenches::none) return truth;
  add_wrenches(body, truth, folder, options.progress);
  for (std::size_t range = 0; range < 3; ++range) {
    double squares = 0;
    for (const TruePose& p : truth.poses) {
      truth.wrench_error = std::max(truth.wrench_error, p.wrench.error);
      if (std::size_t(p.range) != range) continue;
      squares += std::inner_product(p.wrench.force.begin(), p.wrench.force.end(), p.wrench.force.begin(), 0.0);
    }
    if (truth.found[range] > 0) truth.force_rms[range] = std::sqrt(squares / double(truth.found[range]));
  }
  return truth;
}

}  // namespace vps::lab
