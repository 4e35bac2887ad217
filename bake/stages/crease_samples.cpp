// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/crease_samples.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "bake/stages/brick_items.h"
#include "bake/uniform.h"

namespace vps::bake {
namespace {

constexpr std::size_t kAtEdges = 2048;
constexpr std::size_t kAtBends = 6144;
// Of two unit normals' difference, squared: 11 degrees.
constexpr double kSharp = 0.04;

bool is_bent(const Surface& surface, std::uint32_t a, std::uint32_t b) {
  return (surface.normals[a] - surface.normals[b]).squaredNorm() > kSharp;
}

struct Edge {
  Vector from, along;
};

// One in `stride` when there are many triangles. Edges are chosen by their ends, so that both sides of one are chosen.
std::vector<Edge> sharp_edges(const Surface& surface) {
  struct Side {
    std::uint64_t ends;  // the lower vertex in the high word
    std::uint32_t triangle;
    bool operator<(const Side& other) const {
      return ends != other.ends ? ends < other.ends : triangle < other.triangle;
    }
  };
  constexpr std::size_t kEnough = 1 << 15;
  const std::uint64_t stride = 1 + 3 * surface.triangles.size() / kEnough;
  std::vector<Side> sides;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const Triangle& corners = surface.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = corners[k];
      const std::uint64_t b = corners[k == 2 ? 0 : k + 1];
      const std::uint64_t ends = std::min(a, b) << 32 | std::max(a, b);
      if ((ends * 0x9E3779B97F4A7C15ull >> 40) % stride == 0) sides.push_back({ends, t});
    }
  }
  std::sort(sides.begin(), sides.end());
  std::vector<Edge> edges;
  for (std::size_t i = 1; i < sides.size(); ++i) {
    if (sides[i].ends != sides[i - 1].ends || !is_bent(surface, sides[i].triangle, sides[i - 1].triangle)) continue;
    const Vector& from = surface.vertices[sides[i].ends >> 32];
    edges.push_back({from, surface.vertices[sides[i].ends & 0xFFFFFFFFu] - from});
  }
  return edges;
}

Vector in_cube(std::uint64_t counter) {
  return {uniform(counter) - 0.5, uniform(counter + 1) - 0.5, uniform(counter + 2) - 0.5};
}

std::vector<Vector> points_at_edges(const Surface& surface, double voxel_size) {
  const std::vector<Edge> edges = sharp_edges(surface);
  if (edges.empty()) return {};
  std::vector<double> sums;
  double sum = 0;
  for (const Edge& edge : edges) sums.push_back(sum += edge.along.norm());
  std::vector<Vector> points;
  const std::size_t count = enough_places(static_cast<std::size_t>(sum / voxel_size) + 1, 4, kAtEdges);
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint64_t counter = 5 * n;
    const double at = sum * (static_cast<double>(n) + uniform(counter)) / static_cast<double>(count);
    const auto found = static_cast<std::size_t>(std::upper_bound(sums.begin(), sums.end(), at) - sums.begin());
    const Edge& edge = edges[std::min(found, edges.size() - 1)];
    points.emplace_back(edge.from + uniform(counter + 1) * edge.along + voxel_size * in_cube(counter + 2));
  }
  return points;
}

std::vector<Vector> points_at_bends(const Surface& surface, const Grid& grid, const BandField& field, double limit) {
  struct Pair {
    std::uint32_t voxel;
    int axis;  // towards the other voxel of the pair, in the same brick
  };
  constexpr std::uint32_t kNext[3] = {1, kBrickEdge, kBrickEdge * kBrickEdge};
  // Farther out errors are smaller: points all over a wide band would miss the largest ones.
  const double farthest = std::min(limit, 2 * grid.voxel_size);
  const auto for_each_pair = [&](std::size_t brick, const auto& visit) {
    field.for_each_exact(brick, [&](std::uint32_t voxel, std::size_t at) {
      if (std::abs(field.penetration[at]) > farthest) return;
      const std::uint32_t triangle = field.closest[at];
      for (int axis = 0; axis < 3; ++axis) {
        if (voxel / kNext[axis] % kBrickEdge == kBrickEdge - 1) continue;
        const std::uint32_t other = field.triangle(brick, voxel + kNext[axis]);
        if (other != triangle && other != kNoTriangle && is_bent(surface, triangle, other)) visit(Pair{voxel, axis});
      }
    });
  };
  const auto pairs = brick_items<Pair>(field.set.bricks.size(), for_each_pair);
  std::vector<std::size_t> picks(enough_places(pairs.count(), 0.5, kAtBends));
  for (std::size_t n = 0; n < picks.size(); ++n) {
    const double part = (static_cast<double>(n) + uniform(4 * n)) / static_cast<double>(picks.size());
    picks[n] = std::min(static_cast<std::size_t>(part * static_cast<double>(pairs.count())), pairs.count() - 1);
  }
  std::vector<Vector> points;
  for (const auto& [brick, pair] : pairs.find(picks)) {
    Vector from_centre = in_cube(4 * points.size() + 1);
    from_centre[pair.axis] += 0.5;
    points.emplace_back(grid.centre(field.set.bricks[brick], pair.voxel) + grid.voxel_size * from_centre);
  }
  return points;
}

}  // namespace

std::vector<CertificateSample> crease_samples(const Distances& distances, const InsideTest& inside, const Grid& grid,
                                              const BandField& field, double limit) {
  std::vector<Vector> points = points_at_edges(distances.surface, grid.voxel_size);
  const std::vector<Vector> bends = points_at_bends(distances.surface, grid, field, limit);
  points.insert(points.end(), bends.begin(), bends.end());
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<CertificateSample> samples(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t n) {
    samples[n] = {points[n], kFar};
    const double about = distances.tree.distance(points[n], limit + 2 * distances.slack);
    if (about > limit + distances.slack) return;
    const double distance = distances.exact(points[n], about);
    samples[n].penetration = inside.inside(points[n]) ? distance : -distance;
  });
  samples.erase(std::remove_if(samples.begin(), samples.end(),
                               [&](const CertificateSample& sample) { return std::abs(sample.penetration) > limit; }),
                samples.end());
  return samples;
}

}  // namespace vps::bake
