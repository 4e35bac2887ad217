// SPDX-License-Identifier: GPL-3.0-or-later
// Fits a plane to the points below each node, and takes the convex hull in it where they lie on it.
#include "bake/stages/find_hulls.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace vps::bake {
namespace {

// Fewer points are tested as fast one by one.
constexpr std::size_t kFewestPoints = 48;
// A hull costs about as much as four times as many points in a row.
constexpr std::size_t kFewestPerCorner = 4;
constexpr std::size_t kMostCorners = 63;

struct InPlane {
  double u, v;  // in the plane. [m]
  std::uint32_t point;
};

double turn_of(const InPlane& o, const InPlane& a, const InPlane& b) {
  return (a.u - o.u) * (b.v - o.v) - (a.v - o.v) * (b.u - o.u);
}

// Adds the corners of a convex chain between its ends to `out`, but for those that lie closer to the line between their
// neighbours than `flat` (Douglas and Peucker 1973).
void simplify(const std::vector<InPlane>& chain, std::size_t first, std::size_t last, double flat,
              std::vector<std::uint32_t>& out) {
  const double length = std::hypot(chain[last].u - chain[first].u, chain[last].v - chain[first].v);
  std::size_t farthest = first;
  double most = flat;
  for (std::size_t i = first + 1; i < last; ++i) {
    const double off = length > 0 ? std::abs(turn_of(chain[first], chain[last], chain[i])) / length
                                  : std::hypot(chain[i].u - chain[first].u, chain[i].v - chain[first].v);
    if (off <= most) continue;
    most = off;
    farthest = i;
  }
  if (farthest == first) return;
  simplify(chain, first, farthest, flat, out);
  out.push_back(chain[farthest].point);
  simplify(chain, farthest, last, flat, out);
}

// One half of the convex hull of sorted places, its ends included (Andrew 1979).
template <class Iterator>
std::vector<InPlane> half_hull(Iterator first, Iterator last) {
  std::vector<InPlane> chain;
  for (; first != last; ++first) {
    while (chain.size() >= 2 && turn_of(chain[chain.size() - 2], chain.back(), *first) <= 0) chain.pop_back();
    chain.push_back(*first);
  }
  return chain;
}

// The corners of points [first, last), ascending; none if they are not flat.
std::vector<std::uint32_t> corners_of(const std::vector<Point3f>& points, std::uint32_t first, std::uint32_t last,
                                      double flat) {
  const auto at = [&](std::uint32_t i) { return Vector(points[i][0], points[i][1], points[i][2]); };
  Vector mean = Vector::Zero();
  for (std::uint32_t i = first; i < last; ++i) mean += at(i);
  mean /= last - first;
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  for (std::uint32_t i = first; i < last; ++i) squares += (at(i) - mean) * (at(i) - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(squares);  // eigenvalues ascend
  const Eigen::Matrix3d& axis = axes.eigenvectors();
  std::vector<InPlane> places;
  for (std::uint32_t i = first; i < last; ++i) {
    const Vector p = axis.transpose() * (at(i) - mean);
    if (std::abs(p[0]) > flat) return {};
    places.push_back({p[1], p[2], i});
  }
  std::sort(places.begin(), places.end(), [](const InPlane& a, const InPlane& b) {
    return a.u != b.u ? a.u < b.u : a.v != b.v ? a.v < b.v : a.point < b.point;
  });
  std::vector<std::uint32_t> corners = {places.front().point, places.back().point};
  for (const std::vector<InPlane>& chain :
       {half_hull(places.begin(), places.end()), half_hull(places.rbegin(), places.rend())}) {
    simplify(chain, 0, chain.size() - 1, flat, corners);
  }
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  const bool are_few = corners.size() <= kMostCorners && kFewestPerCorner * corners.size() <= last - first;
  return are_few ? corners : std::vector<std::uint32_t>();
}

}  // namespace

NodeHulls find_hulls(const PointTree& tree, const std::vector<Point3f>& points, double flat) {
  const std::size_t nodes = tree.first.size();
  // Points below a node are contiguous.
  std::vector<std::uint32_t> begin(tree.first);
  std::vector<std::uint32_t> end(nodes);
  const std::uint32_t leaves = tree.level_offsets[tree.level_offsets.size() - 2];
  for (std::size_t n = nodes; n-- > 0;) {
    const std::uint32_t last_child = tree.first[n] + tree.count[n] - 1;
    end[n] = n >= leaves ? last_child + 1 : end[last_child];
    if (n < leaves) begin[n] = begin[tree.first[n]];
  }
  std::vector<std::vector<std::uint32_t>> corners(nodes);
  tbb::parallel_for(std::size_t{0}, nodes, [&](std::size_t n) {
    if (end[n] - begin[n] < kFewestPoints) return;
    std::vector<std::uint32_t>& of_node = corners[n];
    of_node = corners_of(points, begin[n], end[n], flat);
    if (of_node.empty()) return;
    const auto place = std::lower_bound(of_node.begin(), of_node.end(), tree.parent_point[n]);
    if (place == of_node.end() || *place != tree.parent_point[n]) of_node.insert(place, tree.parent_point[n]);
  });
  NodeHulls hulls;
  hulls.offsets.push_back(0);
  for (const std::vector<std::uint32_t>& of_node : corners) {
    hulls.points.insert(hulls.points.end(), of_node.begin(), of_node.end());
    hulls.offsets.push_back(static_cast<std::uint32_t>(hulls.points.size()));
  }
  return hulls;
}

}  // namespace vps::bake
