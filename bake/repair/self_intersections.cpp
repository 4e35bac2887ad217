// SPDX-License-Identifier: GPL-3.0-or-later
// Tests triangles with overlapping boxes by CGAL's exact predicates.
#include "bake/repair/self_intersections.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <mutex>

namespace vps::bake {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;

class MeetTest {
 public:
  explicit MeetTest(const Mesh& mesh) : triangles_(mesh.triangles) {
    points_.reserve(mesh.vertices.size());
    for (const Vector& v : mesh.vertices) points_.emplace_back(v.x(), v.y(), v.z());
    flat_.resize(triangles_.size());
    tbb::parallel_for(std::size_t{0}, triangles_.size(), [&](std::size_t i) {
      const Triangle& t = triangles_[i];
      flat_[i] = CGAL::collinear(points_[t[0]], points_[t[1]], points_[t[2]]) ? 1 : 0;
    });
  }

  [[nodiscard]] bool meet(std::uint32_t first, std::uint32_t second) const {
    if (flat_[first] != 0 || flat_[second] != 0) return false;
    const Triangle& a = triangles_[first];
    const Triangle& b = triangles_[second];
    // Positions in a and b of the common vertices.
    std::size_t in_a[3];
    std::size_t in_b[3];
    std::size_t common = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        if (a[i] == b[j]) {
          in_a[common] = i;
          in_b[common++] = j;
        }
      }
    }
    if (common == 3) return true;
    if (common == 2) return folded(a, b, 3 - in_a[0] - in_a[1], 3 - in_b[0] - in_b[1]);
    if (common == 1) return meet_beyond_vertex(a, b, in_a[0]) || meet_beyond_vertex(b, a, in_b[0]);
    return CGAL::do_intersect(triangle(a), triangle(b));
  }

 private:
  // Triangles with a common edge intersect elsewhere only if one is folded onto the other.
  [[nodiscard]] bool folded(const Triangle& a, const Triangle& b, std::size_t tip_a, std::size_t tip_b) const {
    const Point& p = points_[a[(tip_a + 1) % 3]];
    const Point& q = points_[a[(tip_a + 2) % 3]];
    const Point& r = points_[a[tip_a]];
    const Point& s = points_[b[tip_b]];
    if (CGAL::orientation(p, q, r, s) != CGAL::COPLANAR) return false;
    return CGAL::coplanar_orientation(p, q, r, s) == CGAL::POSITIVE;
  }

  // Whether a's edge opposite to the common vertex meets b. Any common segment from the vertex ends on that edge or on
  // b's opposite edge.
  [[nodiscard]] bool meet_beyond_vertex(const Triangle& a, const Triangle& b, std::size_t at_a) const {
    const Point& p = points_[a[(at_a + 1) % 3]];
    const Point& q = points_[a[(at_a + 2) % 3]];
    const Point& u = points_[b[0]];
    const Point& v = points_[b[1]];
    const Point& w = points_[b[2]];
    // Both ends lie on one side of b's plane: by far the most common case.
    const CGAL::Orientation side_p = CGAL::orientation(u, v, w, p);
    const CGAL::Orientation side_q = CGAL::orientation(u, v, w, q);
    if (side_p == side_q && side_p != CGAL::COPLANAR) return false;
    return CGAL::do_intersect(triangle(b), Kernel::Segment_3(p, q));
  }

  [[nodiscard]] Kernel::Triangle_3 triangle(const Triangle& t) const {
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }

  std::vector<Point> points_;
  const std::vector<Triangle>& triangles_;
  std::vector<std::uint8_t> flat_;  // written by several threads, so no bits
};

}  // namespace

std::vector<TrianglePair> self_intersections(const Mesh& mesh) {
  const MeetTest test(mesh);
  const BoxPairs boxes(mesh);
  std::vector<TrianglePair> pairs;
  std::mutex adding;
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, boxes.parts()), [&](const tbb::blocked_range<std::size_t>& parts) {
        // Long triangles can give millions of overlapping boxes, so pairs are tested part by part.
        std::vector<TrianglePair> found;
        std::size_t kept = 0;
        for (std::size_t part = parts.begin(); part < parts.end(); ++part) {
          boxes.find(part, found);
          const auto apart = [&](const TrianglePair& pair) { return !test.meet(pair.first, pair.second); };
          found.erase(std::remove_if(found.begin() + static_cast<std::ptrdiff_t>(kept), found.end(), apart),
                      found.end());
          kept = found.size();
        }
        const std::scoped_lock lock(adding);
        pairs.insert(pairs.end(), found.begin(), found.end());
      });
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace vps::bake
