// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/jump_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "formats/brick_faces.h"

namespace vps::bake {
namespace {

constexpr std::size_t kMostJumps = 512;

struct Jump {
  double size;  // [m]
  octree::Place place;
  bool operator<(const Jump& other) const { return size != other.size ? size > other.size : place < other.place; }
};

void keep_largest(std::vector<Jump>& jumps) {
  std::sort(jumps.begin(), jumps.end());
  jumps.resize(std::min(jumps.size(), kMostJumps));
}

}  // namespace

std::vector<CertificateSample> jump_samples(const Truth& truth, const Grid& grid, const FieldTree& tree,
                                            const StoredSample& stored) {
  std::vector<Jump> jumps;
  double least = 0;  // of those that are kept
  const auto sample = [&](std::uint32_t entry, std::size_t n) { return stored(octree::level_of(entry), n); };
  octree::for_each_sample_on_faces(
      {tree.roots.data(), tree.nodes.data(), tree.root_dims.data()}, sample,
      [&](const octree::Place& place, double here, double there) {
        const double size = std::abs(here - there);
        if (size <= least || std::max(here, there) > truth.inner || std::min(here, there) < -truth.outer) return;
        jumps.push_back({size, place});
        if (jumps.size() < 8 * kMostJumps) return;
        keep_largest(jumps);
        least = jumps.back().size;
      });
  keep_largest(jumps);

  std::vector<CertificateSample> samples(2 * jumps.size());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t n) {
    Vector& point = samples[n].point;
    const double aside = n % 2 != 0 ? 1e-3 : -1e-3;  // into one of the two bricks, whatever the face's axis. [vx]
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double voxels = static_cast<double>(jumps[n / 2].place[axis]) / octree::kPlacesPerVoxel + 0.5 + aside;
      point[static_cast<Eigen::Index>(axis)] = grid.origin[static_cast<Eigen::Index>(axis)] + grid.voxel_size * voxels;
    }
    const double distance = truth.distances.exact(point, truth.distances.tree.distance(point));
    samples[n].penetration = truth.inside.inside(point) ? distance : -distance;
  });
  std::erase_if(
      samples, [&](const CertificateSample& s) { return s.penetration > truth.inner || s.penetration < -truth.outer; });
  return samples;
}

}  // namespace vps::bake
