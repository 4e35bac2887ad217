// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/find_corners.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>

#include "bake/point_grid.h"

namespace vps::bake {
namespace {

// The normals around a vertex, weighed by the triangles' angles there.
class NormalSpread {
 public:
  // @param normal  unit
  void add(const Vector& normal, double weight) {
    sum_ += weight * normal;
    squares_ += weight * normal * normal.transpose();
    whole_ += weight;
  }
  void add(const NormalSpread& other) {
    sum_ += other.sum_;
    squares_ += other.squares_;
    whole_ += other.whole_;
  }
  [[nodiscard]] Vector mean() const { return sum_.normalized(); }
  // How far the normals turn to the side, in the direction in which they do so least.
  [[nodiscard]] double least_across() const {
    const double length = sum_.norm();
    if (!(length > 1e-6 * whole_)) return 0;
    const Vector u = sum_.unitOrthogonal();
    const Vector v = sum_.cross(u) / length;
    // The smaller eigenvalue across the mean normal.
    const double along_u = u.dot(squares_ * u);
    const double along_v = v.dot(squares_ * v);
    const double both = u.dot(squares_ * v);
    return ((along_u + along_v) / 2 - std::hypot((along_u - along_v) / 2, both)) / whole_;
  }

 private:
  Vector sum_ = Vector::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  double whole_ = 0;
};

// Whether the surface falls away from a place. @param way  from the place to another one of the surface
bool falls(const Vector& way, const Vector& out) {
  constexpr double kLevel = 0.1;
  return way.dot(out) <= kLevel * way.norm();
}

// The triangles around a vertex.
struct Fan {
  std::uint32_t vertex;
  NormalSpread spread;
  std::vector<Vector> edges;
};

class FindCorners {
 public:
  FindCorners(const Surface& surface, double reach) : surface_(surface), reach_(reach) {
    find_turns();
    gather_fans();
  }
  [[nodiscard]] std::vector<Corner> sharp() const;
  // @return those that are nowhere near `corners`
  [[nodiscard]] std::vector<Corner> rounded(const std::vector<Corner>& corners) const;

 private:
  void find_turns();
  void gather_fans();
  // Fans of vertices that are close together.
  struct Cluster {
    NormalSpread spread;
    std::vector<std::uint32_t> fans;
  };
  [[nodiscard]] std::vector<Cluster> clusters() const;
  [[nodiscard]] std::optional<Corner> rounded_at(const Cluster& cluster, const std::vector<Cluster>& all,
                                                 const PointGrid& grid) const;
  [[nodiscard]] const Vector& place_of(std::uint32_t fan) const { return surface_.vertices[fans_[fan].vertex]; }
  [[nodiscard]] const Vector& place_of(const Cluster& cluster) const { return place_of(cluster.fans.front()); }
  [[nodiscard]] Corner corner_at(const Fan& fan, double sharpness) const {
    return {surface_.vertices[fan.vertex], first_[fan.vertex], sharpness};
  }
  [[nodiscard]] bool are_near(const Vector& a, const Vector& b) const {
    return (a - b).squaredNorm() <= reach_ * reach_;
  }

  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  const Surface& surface_;
  const double reach_;
  std::vector<std::uint32_t> first_;   // triangle of each vertex
  std::vector<std::uint32_t> fan_of_;  // of each vertex
  std::vector<Fan> fans_;
};

// Few vertices get a fan: those where normals turn as on a corner, or as on a ball with a radius of the reach.
void FindCorners::find_turns() {
  constexpr double kTurned = 0.1;  // 1 - cos: at a corner some normals differ by more
  const double curved = 0.08 / (reach_ * reach_);
  first_.assign(surface_.vertices.size(), kNone);
  fan_of_.assign(surface_.vertices.size(), kNone);
  for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
    double squares[3];  // of the edge from each corner to the next
    for (int i = 0; i < 3; ++i) squares[i] = (surface_.corner(t, (i + 1) % 3) - surface_.corner(t, i)).squaredNorm();
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t v = surface_.triangles[t][i];
      if (first_[v] == kNone) first_[v] = t;
      const double least = std::min(kTurned, curved * std::min(squares[i], squares[(i + 2) % 3]));
      if (fan_of_[v] != kNone || 1 - surface_.normals[t].dot(surface_.normals[first_[v]]) < least) continue;
      fan_of_[v] = static_cast<std::uint32_t>(fans_.size());
      fans_.push_back({v, {}, {}});
    }
  }
}

void FindCorners::gather_fans() {
  if (fans_.empty()) return;
  for (std::uint32_t t = 0; t < surface_.triangles.size(); ++t) {
    const auto& at = surface_.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) {
      if (fan_of_[at[i]] == kNone) continue;
      Fan& fan = fans_[fan_of_[at[i]]];
      const Vector a = surface_.vertices[at[(i + 1) % 3]] - surface_.vertices[at[i]];
      const Vector b = surface_.vertices[at[(i + 2) % 3]] - surface_.vertices[at[i]];
      fan.spread.add(surface_.normals[t], std::atan2(a.cross(b).norm(), a.dot(b)));
      fan.edges.push_back(a);
    }
  }
}

std::vector<Corner> FindCorners::sharp() const {
  std::vector<Corner> corners;
  for (const Fan& fan : fans_) {
    const Vector out = fan.spread.mean();
    const bool is_convex =
        std::all_of(fan.edges.begin(), fan.edges.end(), [&](const Vector& edge) { return falls(edge, out); });
    const double sharp = is_convex ? fan.spread.least_across() : 0;
    if (sharp > kCorner) corners.push_back(corner_at(fan, sharp));
  }
  return corners;
}

// A scan may have thousands of vertices within reach, so that each must not be compared with all others.
std::vector<FindCorners::Cluster> FindCorners::clusters() const {
  std::map<std::array<std::int64_t, 3>, std::uint32_t> numbers;  // by cell
  std::vector<Cluster> clusters;
  for (std::uint32_t i = 0; i < fans_.size(); ++i) {
    const Vector cell = (place_of(i) * (4 / reach_)).array().floor();
    const auto [at, is_new] = numbers.try_emplace(
        {static_cast<std::int64_t>(cell.x()), static_cast<std::int64_t>(cell.y()), static_cast<std::int64_t>(cell.z())},
        static_cast<std::uint32_t>(clusters.size()));
    if (is_new) clusters.emplace_back();
    Cluster& cluster = clusters[at->second];
    cluster.spread.add(fans_[i].spread);
    cluster.fans.push_back(i);
  }
  return clusters;
}

// The highest vertex of a cluster, if all that turns within reach of it is sharp together, and nowhere higher.
std::optional<Corner> FindCorners::rounded_at(const Cluster& cluster, const std::vector<Cluster>& all,
                                              const PointGrid& grid) const {
  NormalSpread spread;
  std::vector<std::uint32_t> near;
  grid.for_each_near(place_of(cluster), 1, [&](std::uint32_t i) {
    if (!are_near(place_of(all[i]), place_of(cluster))) return;
    spread.add(all[i].spread);
    near.push_back(i);
  });
  const double sharp = spread.least_across();
  if (!(sharp > kCorner)) return {};
  const Vector out = spread.mean();
  const auto highest = *std::max_element(cluster.fans.begin(), cluster.fans.end(),
                                         [&](auto i, auto k) { return out.dot(place_of(i)) < out.dot(place_of(k)); });
  const Vector& top = place_of(highest);
  const auto is_below = [&](std::uint32_t i) {
    const Vector way = place_of(i) - top;
    return falls(way, out) && std::all_of(fans_[i].edges.begin(), fans_[i].edges.end(),
                                          [&](const Vector& edge) { return falls(way + edge, out); });
  };
  const bool is_convex = std::all_of(near.begin(), near.end(), [&](std::uint32_t i) {
    return std::all_of(all[i].fans.begin(), all[i].fans.end(), is_below);
  });
  if (!is_convex) return {};
  return corner_at(fans_[highest], sharp);
}

std::vector<Corner> FindCorners::rounded(const std::vector<Corner>& corners) const {
  const std::vector<Cluster> all = clusters();
  PointGrid grid(reach_);
  for (std::uint32_t i = 0; i < all.size(); ++i) grid.insert(place_of(all[i]), i);
  std::vector<Corner> found;
  for (const Cluster& cluster : all) {
    if (const std::optional<Corner> corner = rounded_at(cluster, all, grid)) found.push_back(*corner);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Corner& a, const Corner& b) { return a.sharpness > b.sharpness; });
  PointGrid taken(reach_);
  std::vector<Vector> places;
  const auto take = [&](const Vector& place) {
    taken.insert(place, static_cast<std::uint32_t>(places.size()));
    places.push_back(place);
  };
  for (const Corner& corner : corners) take(corner.place);
  std::vector<Corner> kept;
  for (const Corner& corner : found) {
    bool is_free = true;
    taken.for_each_near(corner.place, 1,
                        [&](std::uint32_t i) { is_free = is_free && !are_near(places[i], corner.place); });
    if (!is_free) continue;
    take(corner.place);
    kept.push_back(corner);
  }
  return kept;
}

}  // namespace

std::vector<Corner> find_corners(const Surface& surface, double voxel_size) {
  constexpr double kReach_vx = 2;
  const FindCorners find(surface, kReach_vx * voxel_size);
  std::vector<Corner> corners = find.sharp();
  const std::vector<Corner> rounded = find.rounded(corners);
  corners.insert(corners.end(), rounded.begin(), rounded.end());
  return corners;
}

}  // namespace vps::bake
