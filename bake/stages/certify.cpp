// SPDX-License-Identifier: GPL-3.0-or-later
// The error certificate: sampled against exact distances from the mesh (CGAL), not against the field's own arithmetic.
#include "bake/stages/certify.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "bake/stages/exact_distance.h"
#include "bake/uniform.h"

namespace vps::bake {

double Distances::exact(const Vector& point, double about) const {
  thread_local std::vector<std::uint32_t> near;
  near.clear();
  tree.find_within(point, about + slack, near);
  return exact_distance(surface, point, near);
}

std::vector<CertificateSample> certificate_samples(const Distances& distances, const InsideTest& inside,
                                                   const Grid& grid, const BandField& field, double band_inner,
                                                   double band_outer) {
  // Voxels with their centre in the band.
  std::vector<std::size_t> voxels;
  for (std::size_t at = 0; at < field.closest.size(); ++at) {
    const double v = field.penetration[at];
    if (v <= band_inner && v >= -band_outer) voxels.push_back(at);
  }
  std::vector<CertificateSample> samples(std::min(kCertificateSamples, 4 * voxels.size()));
  std::vector<std::uint8_t> used(samples.size(), 0);
  const double half_diagonal = std::sqrt(0.75) * grid.voxel_size;
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    const std::uint64_t counter = 4 * static_cast<std::uint64_t>(n);
    const auto pick = static_cast<std::size_t>(uniform(counter) * static_cast<double>(voxels.size()));
    const std::size_t at = voxels[std::min(pick, voxels.size() - 1)];
    CertificateSample& sample = samples[n];
    const Vector centre =
        grid.centre(field.set.bricks[at / kBrickVoxels], static_cast<std::uint32_t>(at % kBrickVoxels));
    const Vector offset(uniform(counter + 1) - 0.5, uniform(counter + 2) - 0.5, uniform(counter + 3) - 0.5);
    sample.point = centre + grid.voxel_size * offset;
    const bool within = inside.inside(sample.point);
    const double limit = (within ? band_inner : band_outer) - half_diagonal;
    const double about = distances.tree.distance(sample.point, limit + 2 * distances.slack);
    if (about > limit + distances.slack) return;
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
  double squares = 0;
  for (std::size_t n = 0; n < samples.size(); ++n) {
    errors[n] = std::abs(reconstruct(samples[n].point) - samples[n].penetration);
    squares += errors[n] * errors[n];
  }
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
  };
  const double slack = truth.distances.slack;
  // The error at a point, or -1 where the certificate does not cover it.
  const auto error_at = [&](CertificateSample& at, double distance, double more) {
    if (distance > std::max(truth.inner, truth.outer) + more || distance < truth.least - more) return -1.0;
    at.penetration = truth.inside.inside(at.point) ? distance : -distance;
    if (at.penetration > truth.inner + more || at.penetration < -truth.outer - more) return -1.0;
    return std::abs(reconstruct(at.point) - at.penetration) + more;
  };
  std::vector<Place> places;
  places.reserve(samples.size());
  for (const CertificateSample& sample : samples) {
    places.push_back({sample, std::abs(reconstruct(sample.point) - sample.penetration)});
  }
  const auto last = places.begin() + static_cast<std::ptrdiff_t>(std::min(truth.starts, places.size()));
  std::partial_sort(places.begin(), last, places.end(),
                    [](const Place& a, const Place& b) { return a.error > b.error; });
  places.erase(last, places.end());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t n) {
    Place& best = places[n];
    // Cells are a quarter voxel to two voxels wide.
    for (double step = 0.5 * truth.voxel_size; step > 0.02 * truth.voxel_size; step /= 2) {
      for (int way = 0; way < 6; ++way) {
        CertificateSample other = best.sample;
        other.point[way / 2] += way % 2 == 0 ? step : -step;
        const double at_most = std::abs(best.sample.penetration) + step + 2 * slack;
        const double about = truth.distances.tree.distance(other.point, at_most);
        if (error_at(other, about, slack) <= best.error) continue;
        const double error = error_at(other, truth.distances.exact(other.point, about), 0);
        if (error > best.error) best = {other, error};
      }
    }
  });
  for (const Place& place : places) {
    if (place.error <= certificate.max) continue;
    certificate.max = place.error;
    certificate.worst_at = {place.sample.point.x(), place.sample.point.y(), place.sample.point.z()};
  }
  certificate.bound = std::max(certificate.bound, certificate.max);
}

}  // namespace vps::bake
