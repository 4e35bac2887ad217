// SPDX-License-Identifier: GPL-3.0-or-later
// The error certificate: sampled against exact distances from the mesh (CGAL), not against the field's own arithmetic.
#include "bake/stages/certify.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/brick_items.h"
#include "bake/stages/exact_distance.h"
#include "bake/uniform.h"

namespace vps::bake {
namespace {

// Of the search for the largest error: many starts, of which only the worst are followed far.
struct Round {
  std::size_t share;  // one start in so many
  std::size_t tries;  // of each
};
constexpr Round kRounds[] = {{1, 8}, {4, 16}, {16, 40}};
constexpr std::size_t kTries = 64;

}  // namespace

double Distances::exact(const Vector& point, double about) const {
  thread_local std::vector<std::uint32_t> near;
  near.clear();
  tree.find_within(point, about + slack, near);
  return exact_distance(surface, point, near);
}

bool is_inside(const InsideTest& inside, const Vector& point, double least, const CertificateSample& known) {
  const double apart = (point - known.point).norm();
  return apart < least + std::abs(known.penetration) ? known.penetration > 0 : inside.inside(point);
}

std::vector<CertificateSample> certificate_samples(const Distances& distances, const InsideTest& inside,
                                                   const Grid& grid, const BandField& field, double band_inner,
                                                   double band_outer) {
  // Voxels with their centre in the band.
  const auto for_each_voxel = [&](std::size_t brick, const auto& visit) {
    field.for_each_exact(brick, [&](std::uint32_t voxel, std::size_t at) {
      const double v = field.penetration[at];
      if (v <= band_inner && v >= -band_outer) visit(voxel);
    });
  };
  const auto voxels = brick_items<std::uint32_t>(field.set.bricks.size(), for_each_voxel);
  std::vector<CertificateSample> samples(enough_places(voxels.count(), 0.25, kCertificateSamples));
  std::vector<std::size_t> picks(samples.size());
  for (std::size_t n = 0; n < picks.size(); ++n) {
    const double pick = uniform(4 * static_cast<std::uint64_t>(n)) * static_cast<double>(voxels.count());
    picks[n] = std::min(static_cast<std::size_t>(pick), voxels.count() - 1);
  }
  const auto chosen = voxels.find(picks);
  std::vector<std::uint8_t> used(samples.size(), 0);
  const double half_diagonal = std::sqrt(0.75) * grid.voxel_size;
  const double farthest = std::max(band_inner, band_outer) - half_diagonal;
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    const std::uint64_t counter = 4 * static_cast<std::uint64_t>(n);
    CertificateSample& sample = samples[n];
    const Vector centre = grid.centre(field.set.bricks[chosen[n].brick], chosen[n].item);
    const Vector offset(uniform(counter + 1) - 0.5, uniform(counter + 2) - 0.5, uniform(counter + 3) - 0.5);
    sample.point = centre + grid.voxel_size * offset;
    const double slack = distances.slack;
    const double about = distances.tree.distance(sample.point, farthest + 2 * slack);
    if (about > farthest + slack) return;
    const bool within = inside.inside(sample.point);
    const double limit = (within ? band_inner : band_outer) - half_diagonal;
    if (about > limit + slack) return;
    const double distance = distances.exact(sample.point, about);
    if (distance > limit) return;
    sample.penetration = within ? distance : -distance;
    used[n] = 1;
  });
  std::size_t kept = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    if (used[n] != 0) samples[kept++] = samples[n];
  }
  samples.resize(kept);
  return samples;
}

FieldCertificate certify(const std::vector<CertificateSample>& samples, const Reconstruction& reconstruct) {
  FieldCertificate certificate;
  if (samples.empty()) return certificate;
  std::vector<double> errors(samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    errors[n] = std::abs(reconstruct(samples[n].point) - samples[n].penetration);
  });
  double squares = 0;
  for (const double error : errors) squares += error * error;
  const auto worst = static_cast<std::size_t>(std::max_element(errors.begin(), errors.end()) - errors.begin());
  const Vector& at = samples[worst].point;
  certificate.worst_at = {at.x(), at.y(), at.z()};
  certificate.max = errors[worst];
  certificate.rms = std::sqrt(squares / static_cast<double>(errors.size()));
  const auto p99 = errors.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(errors.size() - 1));
  std::nth_element(errors.begin(), p99, errors.end());
  certificate.p99 = *p99;
  certificate.bound = certificate.max;
  return certificate;
}

void find_worst(const std::vector<CertificateSample>& samples, const Reconstruction& reconstruct, const Truth& truth,
                FieldCertificate& certificate) {
  struct Place {
    CertificateSample sample;
    double error;
    std::size_t number;  // breaks ties, and chooses the steps
    double step;         // [m]
  };
  const double slack = truth.distances.slack;
  const double farthest = std::max(truth.inner, truth.outer);
  const auto is_covered = [&](double penetration, double more) {
    const double distance = std::abs(penetration);
    return distance >= truth.least - more && penetration <= truth.inner + more && penetration >= -truth.outer - more;
  };
  std::vector<Place> places(samples.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    const CertificateSample& sample = samples[n];
    places[n] = {sample, std::abs(reconstruct(sample.point) - sample.penetration), n, truth.voxel_size / 2};
  });
  const auto keep_worst = [&](std::size_t count) {
    const auto last = places.begin() + static_cast<std::ptrdiff_t>(std::min(count, places.size()));
    std::partial_sort(places.begin(), last, places.end(), [](const Place& a, const Place& b) {
      return a.error != b.error ? a.error > b.error : a.number < b.number;
    });
    places.erase(last, places.end());
  };
  const auto climb = [&](Place& best, std::size_t first, std::size_t tries) {
    // Steps along the axes would stop at a crease that is not parallel to one: the error has a ridge there.
    for (std::size_t i = first; i < first + tries; ++i) {
      const std::uint64_t counter = 3 * (best.number * kTries + i);
      const Vector way(uniform(counter) - 0.5, uniform(counter + 1) - 0.5, uniform(counter + 2) - 0.5);
      CertificateSample other = best.sample;
      other.point += 2 * best.step * way;
      const auto is_worse = [&] {
        const double at_most = std::abs(best.sample.penetration) + 2 * best.step + 2 * slack;
        const double about = truth.distances.tree.distance(other.point, at_most);
        if (about > farthest + slack || about < truth.least - slack) return false;
        const double side = is_inside(truth.inside, other.point, about - slack, best.sample) ? 1 : -1;
        if (!is_covered(side * about, slack)) return false;
        const double found = reconstruct(other.point);
        if (std::abs(found - side * about) + slack <= best.error) return false;
        other.penetration = side * truth.distances.exact(other.point, about);
        const double error = std::abs(found - other.penetration);
        if (!is_covered(other.penetration, 0) || error <= best.error) return false;
        best = {other, error, best.number, best.step};
        return true;
      };
      best.step = is_worse() ? std::min(1.5 * best.step, truth.voxel_size / 2) : 0.9 * best.step;
    }
  };
  const std::size_t starts = enough_places(samples.size(), 0.25, truth.starts);
  std::size_t tried = 0;
  for (const Round& round : kRounds) {
    keep_worst(starts / round.share);
    tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) { climb(places[n], tried, round.tries); });
    tried += round.tries;
  }
  for (const Place& place : places) {
    if (place.error <= certificate.max) continue;
    certificate.max = place.error;
    certificate.worst_at = {place.sample.point.x(), place.sample.point.y(), place.sample.point.z()};
  }
  certificate.bound = std::max(certificate.bound, certificate.max);
}

double layers_error_bound(double end) {
  const double half_diagonal = std::sqrt(0.75);
  double largest = half_diagonal + std::min(end, std::sqrt(3.0));  // of layer 0
  for (double layer = 1; layer - 1 <= end; ++layer) {
    const double deepest = std::min(end, std::sqrt(3.0) * (layer + 1));
    largest = std::max({largest, half_diagonal + 1, deepest - (layer - half_diagonal)});
  }
  return largest;
}

}  // namespace vps::bake
