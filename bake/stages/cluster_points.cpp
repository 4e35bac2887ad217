// SPDX-License-Identifier: GPL-3.0-or-later
// Bottom-up clustering. Paper: Sec. 2.1.2: take the K nearest points, start again at the next nearest one; tag and
// reassign outliers; then cluster the parents in the same way until one cluster is left.
#include "bake/stages/cluster_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bake/point_grid.h"

namespace vps::bake {
namespace {

struct Cluster {
  std::vector<std::uint32_t> members;  // numbers of points of this level
  std::uint32_t parent = 0;            // the member nearest to the average
};

class LevelClustering {
 public:
  /// @param outlier  threshold: 1.5 times the radius of a round cluster of K points. [m]
  LevelClustering(const std::vector<Vector>& points, double outlier, std::uint32_t branching)
      : points_(points), branching_(branching), outlier_(outlier), free_(outlier_), taken_(points.size(), false) {
    for (std::uint32_t i = 0; i < points.size(); ++i) free_.insert(points[i], i);
  }

  std::vector<Cluster> run() {
    std::uint32_t start = 0;
    std::uint32_t scan = 0;  // every point before this is taken
    while (true) {
      while (scan < points_.size() && taken_[scan]) ++scan;
      if (scan == points_.size()) break;
      if (start == kNoTriangle || taken_[start]) start = scan;
      start = form_cluster(start);
    }
    reassign_outliers();
    return std::move(clusters_);
  }

 private:
  struct Candidate {
    double squared;
    std::uint32_t point;
    bool operator<(const Candidate& other) const {
      return squared != other.squared ? squared < other.squared : point < other.point;
    }
  };

  void take(std::uint32_t point) {
    taken_[point] = true;
    free_.remove(points_[point], point);
  }

  // Returns the next start: the nearest point that did not fit in, or kNoTriangle.
  std::uint32_t form_cluster(std::uint32_t start) {
    candidates_.clear();
    free_.for_each_near(points_[start], 2, [&](std::uint32_t q) {
      const double squared = (points_[q] - points_[start]).squaredNorm();
      // Members farther than this would be outliers at once, because the parent lies between.
      if (squared <= 4 * outlier_ * outlier_) candidates_.push_back({squared, q});
    });
    const std::size_t wanted = std::min<std::size_t>(branching_ + 1, candidates_.size());
    std::partial_sort(candidates_.begin(), candidates_.begin() + static_cast<std::ptrdiff_t>(wanted),
                      candidates_.end());
    Cluster cluster;
    for (std::size_t i = 0; i < std::min<std::size_t>(branching_, wanted); ++i) {
      cluster.members.push_back(candidates_[i].point);
      take(candidates_[i].point);
    }
    const std::uint32_t next = wanted > branching_ ? candidates_[branching_].point : kNoTriangle;
    choose_parent(cluster);
    tag_outliers(cluster);
    clusters_.push_back(std::move(cluster));
    return next;
  }

  void choose_parent(Cluster& cluster) const {
    Vector mean = Vector::Zero();
    for (const std::uint32_t m : cluster.members) mean += points_[m];
    mean /= static_cast<double>(cluster.members.size());
    Candidate best{std::numeric_limits<double>::infinity(), 0};
    for (const std::uint32_t m : cluster.members) best = std::min(best, {(points_[m] - mean).squaredNorm(), m});
    cluster.parent = best.point;
  }

  // Points too far from the parent are tagged one by one, farthest first. The parent is chosen anew each time.
  void tag_outliers(Cluster& cluster) {
    while (cluster.members.size() > 1) {
      Candidate worst{-1, 0};
      for (const std::uint32_t m : cluster.members) {
        worst = std::max(worst, {(points_[m] - points_[cluster.parent]).squaredNorm(), m});
      }
      if (worst.squared <= outlier_ * outlier_) return;
      std::erase(cluster.members, worst.point);
      tagged_.push_back(worst.point);
      choose_parent(cluster);
    }
  }

  // A tagged point joins the nearest parent under the threshold, or makes a cluster of its own.
  void reassign_outliers() {
    PointGrid parents(outlier_);
    for (std::uint32_t c = 0; c < clusters_.size(); ++c) parents.insert(points_[clusters_[c].parent], c);
    std::sort(tagged_.begin(), tagged_.end());
    for (const std::uint32_t point : tagged_) {
      Candidate best{outlier_ * outlier_, kNoTriangle};
      parents.for_each_near(points_[point], 1, [&](std::uint32_t c) {
        best = std::min(best, {(points_[clusters_[c].parent] - points_[point]).squaredNorm(), c});
      });
      if (best.point != kNoTriangle) {
        clusters_[best.point].members.push_back(point);
      } else {
        parents.insert(points_[point], static_cast<std::uint32_t>(clusters_.size()));
        clusters_.push_back({{point}, point});
      }
    }
  }

  const std::vector<Vector>& points_;
  const std::uint32_t branching_;
  const double outlier_;
  PointGrid free_;
  std::vector<bool> taken_;
  std::vector<Candidate> candidates_;
  std::vector<std::uint32_t> tagged_;
  std::vector<Cluster> clusters_;
};

// For few points, or points too scattered for the rule above: splits them along the longest axis until K are left.
void halve(const std::vector<Vector>& points, std::vector<std::uint32_t>::iterator first,
           std::vector<std::uint32_t>::iterator last, std::uint32_t branching, std::vector<Cluster>& out) {
  if (last - first <= branching) {
    Cluster cluster{{first, last}, 0};
    Vector mean = Vector::Zero();
    for (const std::uint32_t m : cluster.members) mean += points[m];
    mean /= static_cast<double>(cluster.members.size());
    cluster.parent = *std::min_element(first, last, [&](std::uint32_t a, std::uint32_t b) {
      const double da = (points[a] - mean).squaredNorm();
      const double db = (points[b] - mean).squaredNorm();
      return da != db ? da < db : a < b;
    });
    out.push_back(std::move(cluster));
    return;
  }
  Vector low = points[*first];
  Vector high = low;
  for (auto it = first; it != last; ++it) {
    low = low.cwiseMin(points[*it]);
    high = high.cwiseMax(points[*it]);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  // Split at a multiple of K so that clusters stay full.
  const auto clusters = (last - first + branching - 1) / branching;
  const auto middle = first + clusters / 2 * branching;
  std::nth_element(first, middle, last, [&](std::uint32_t a, std::uint32_t b) {
    return points[a][axis] != points[b][axis] ? points[a][axis] < points[b][axis] : a < b;
  });
  halve(points, first, middle, branching, out);
  halve(points, middle, last, branching, out);
}

std::vector<Cluster> cluster_group(const std::vector<Vector>& points, double outlier, std::uint32_t branching) {
  std::vector<Cluster> clusters;
  if (points.size() > branching) clusters = LevelClustering(points, outlier, branching).run();
  // The tree must shrink: a level may have at most half as many clusters as points.
  if (clusters.empty() || clusters.size() > (points.size() + 1) / 2) {
    clusters.clear();
    std::vector<std::uint32_t> all(points.size());
    std::iota(all.begin(), all.end(), 0U);
    halve(points, all.begin(), all.end(), branching, clusters);
  }
  return clusters;
}

// The points of a level, and the faces that they lie in; 0: none.
struct Level {
  std::vector<Vector> points;
  std::vector<std::uint32_t> original;
  std::vector<std::uint32_t> faces;
};

// Clusters each face, and the points in no face.
std::vector<Cluster> cluster_level(const Level& level, double area, std::uint32_t branching) {
  const double outlier = 1.5 * std::sqrt(area / static_cast<double>(level.points.size()) * branching / M_PI);
  std::vector<std::vector<std::uint32_t>> groups;
  for (std::uint32_t i = 0; i < level.points.size(); ++i) {
    const std::size_t face = level.faces[i];
    if (face >= groups.size()) groups.resize(face + 1);
    groups[face].push_back(i);
  }
  std::vector<Cluster> clusters;
  for (const std::vector<std::uint32_t>& group : groups) {
    if (group.empty()) continue;
    std::vector<Vector> points;
    for (const std::uint32_t i : group) points.push_back(level.points[i]);
    for (Cluster& cluster : cluster_group(points, outlier, branching)) {
      for (std::uint32_t& member : cluster.members) member = group[member];
      cluster.parent = group[cluster.parent];
      clusters.push_back(std::move(cluster));
    }
  }
  return clusters;
}

// The parents of a level's clusters. A face of one cluster is complete, and its cluster one like any other.
Level parents_of(const std::vector<Cluster>& clusters, const Level& level) {
  Level next;
  std::vector<std::uint32_t> left;  // clusters of each face
  for (const Cluster& cluster : clusters) {
    next.points.push_back(level.points[cluster.parent]);
    next.original.push_back(level.original[cluster.parent]);
    const std::uint32_t face = level.faces[cluster.parent];
    next.faces.push_back(face);
    if (face >= left.size()) left.resize(face + 1);
    ++left[face];
  }
  for (std::uint32_t& face : next.faces) {
    if (left[face] == 1) face = 0;
  }
  return next;
}

// Lays the levels out breadth first from the root down.
// @param parents  per level and cluster, the original number of the parent point
PointTree flatten(const std::vector<std::vector<Cluster>>& levels,
                  const std::vector<std::vector<std::uint32_t>>& parents) {
  PointTree tree;
  std::vector<std::uint32_t> nodes = {0};  // clusters of the current level, in tree order
  tree.level_offsets.push_back(0);
  for (std::size_t level = levels.size(); level-- > 0;) {
    const auto end = static_cast<std::uint32_t>(tree.level_offsets.back() + nodes.size());
    std::vector<std::uint32_t> next;
    for (const std::uint32_t node : nodes) {
      const Cluster& cluster = levels[level][node];
      tree.first.push_back((level == 0 ? 0 : end) + static_cast<std::uint32_t>(next.size()));
      tree.count.push_back(static_cast<std::uint32_t>(cluster.members.size()));
      tree.parent_point.push_back(parents[level][node]);
      next.insert(next.end(), cluster.members.begin(), cluster.members.end());
    }
    tree.level_offsets.push_back(end);
    nodes = std::move(next);
  }
  tree.order = std::move(nodes);
  std::vector<std::uint32_t> position_of(tree.order.size());
  for (std::uint32_t i = 0; i < tree.order.size(); ++i) position_of[tree.order[i]] = i;
  for (std::uint32_t& point : tree.parent_point) point = position_of[point];
  return tree;
}

}  // namespace

PointTree cluster_points(const std::vector<Vector>& positions, const std::vector<std::uint32_t>& faces,
                         double surface_area, std::uint32_t branching) {
  std::vector<std::vector<Cluster>> levels;
  std::vector<std::vector<std::uint32_t>> parents;
  Level level{positions, std::vector<std::uint32_t>(positions.size()), faces};
  std::iota(level.original.begin(), level.original.end(), 0U);
  level.faces.resize(positions.size());
  do {
    levels.push_back(cluster_level(level, surface_area, branching));
    level = parents_of(levels.back(), level);
    parents.push_back(level.original);
  } while (levels.back().size() > 1);
  return flatten(levels, parents);
}

}  // namespace vps::bake
