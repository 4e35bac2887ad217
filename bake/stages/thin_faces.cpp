// SPDX-License-Identifier: GPL-3.0-or-later
// Poisson disks whose radius grows with the distance from the edges, chosen among the samples of an even shell.
#include "bake/stages/thin_faces.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bake/point_grid.h"

namespace vps::bake {
namespace {

constexpr double kOneFace = 0.94;  // 20 degrees
// A sample's cell is no part of a face if the length of its vector area, divided by its area, is below this: an edge of
// half a degree in the middle. Seen from a plane that such an edge touches, the faces fall off on both sides.
constexpr double kFaceIsFlat = 1 - 1e-5;

// Whether two samples lie in each other's tangent plane.
bool are_on_one_face(const Sample& a, const Sample& b, double sag) {
  const Vector between = b.position - a.position;
  return a.normal.dot(b.normal) > kOneFace && std::abs(a.normal.dot(between)) <= sag &&
         std::abs(b.normal.dot(between)) <= sag;
}

// How far each sample speaks for others. [m]
std::vector<double> reaches(const std::vector<Sample*>& samples, double most) {
  PointGrid features(most);
  for (std::uint32_t i = 0; i < samples.size(); ++i) {
    if (!is_on_face(*samples[i])) features.insert(samples[i]->position, i);
  }
  std::vector<double> reach(samples.size());
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(samples.size()), [&](std::uint32_t i) {
    const Vector& p = samples[i]->position;
    double nearest = most;
    features.for_each_near(p, 1,
                           [&](std::uint32_t q) { nearest = std::min(nearest, (samples[q]->position - p).norm()); });
    reach[i] = nearest;
  });
  return reach;
}

}  // namespace

bool is_on_face(const Sample& sample) {
  return !sample.on_edge && sample.vector_area.norm() >= kFaceIsFlat * sample.area;
}

double thin_faces(std::vector<Sample*>& samples, double spacing, const Thinning& thinning) {
  const double most = thinning.most * spacing;
  const std::vector<double> reach = reaches(samples, most);
  // Dense places first: they bound those around them.
  std::vector<std::uint32_t> order(samples.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return reach[a] < reach[b]; });
  PointGrid stay(most);
  std::vector<std::uint32_t> gone;
  // The nearest sample that speaks for one.
  const auto speaker = [&](std::uint32_t i, double& least) {
    Sample* nearest = nullptr;
    stay.for_each_near(samples[i]->position, 1, [&](std::uint32_t q) {
      const double squared = (samples[q]->position - samples[i]->position).squaredNorm();
      if (squared >= least || !are_on_one_face(*samples[i], *samples[q], thinning.sag)) return;
      least = squared;
      nearest = samples[q];
    });
    return nearest;
  };
  for (const std::uint32_t i : order) {
    double least = reach[i] * reach[i];
    if (reach[i] > spacing && speaker(i, least) != nullptr) {
      gone.push_back(i);
    } else {
      stay.insert(samples[i]->position, i);
    }
  }
  double farthest = 0;
  std::sort(gone.begin(), gone.end());
  for (const std::uint32_t i : gone) {
    double least = std::numeric_limits<double>::infinity();
    Sample& nearest = *speaker(i, least);
    nearest.area += samples[i]->area;
    nearest.vector_area += samples[i]->vector_area;
    farthest = std::max(farthest, std::sqrt(least));
  }
  for (const std::uint32_t i : gone) samples[i] = nullptr;
  std::erase(samples, nullptr);
  return farthest;
}

}  // namespace vps::bake
