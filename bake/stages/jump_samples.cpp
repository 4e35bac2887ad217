// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/jump_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
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

// In no order. @return the least of them
double keep_largest(std::vector<Jump>& jumps) {
  const auto last = jumps.begin() + kMostJumps - 1;
  std::nth_element(jumps.begin(), last, jumps.end());
  const double least = last->size;
  jumps.resize(kMostJumps);
  return least;
}

std::vector<Jump> largest_jumps(const Truth& truth, const StoredSamples& stored) {
  const FieldTree& tree = stored.tree;
  const octree::Octree octree{tree.roots.data(), tree.nodes.data(), tree.root_dims.data()};
  const auto sample = [&](std::uint32_t entry, std::size_t n) { return stored(octree::level_of(entry), n); };
  std::vector<Jump> kept;
  double least = 0;  // of those that are kept
  const auto find_under = [&](std::size_t root, std::vector<Jump>& found) {
    octree::for_each_sample_on_faces(octree, root, sample, [&](const octree::Place& place, double here, double there) {
      const double size = std::abs(here - there);
      if (size <= least || std::max(here, there) > truth.inner || std::min(here, there) < -truth.outer) return;
      found.push_back({size, place});
    });
  };
  std::vector<std::uint32_t> roots;
  for (std::uint32_t root = 0; root < octree.root_count(); ++root) {
    if (octree::is_node(tree.roots[root])) roots.push_back(root);
  }
  // Works in parts, so that few jumps are held that are no larger than those before them.
  constexpr std::size_t kPart = 128;
  std::array<std::vector<Jump>, kPart> found;
  for (std::size_t first = 0; first < roots.size(); first += kPart) {
    const std::size_t count = std::min(kPart, roots.size() - first);
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t n) {
      found[n].clear();
      find_under(roots[first + n], found[n]);
    });
    for (std::size_t n = 0; n < count; ++n) {
      for (const Jump& jump : found[n]) {
        if (jump.size <= least) continue;
        kept.push_back(jump);
        if (kept.size() < 8 * kMostJumps) continue;
        least = keep_largest(kept);
      }
    }
  }
  if (kept.size() > kMostJumps) (void)keep_largest(kept);
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace

std::vector<CertificateSample> jump_samples(const Truth& truth, const Grid& grid, const StoredSamples& stored) {
  const std::vector<Jump> jumps = largest_jumps(truth, stored);
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
