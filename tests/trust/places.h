// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Random places, rays, poses and motions near a body, and places near those.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "runtime/vps_queries.h"
#include "tests/support/poses.h"
#include "tests/trust/promises.h"

namespace vps::test {

using Point = std::array<double, 3>;

inline Eigen::Vector3d vector_of(const Point& p) {
  return {p[0], p[1], p[2]};
}
inline Point point_of(const Eigen::Vector3d& p) {
  return {p.x(), p.y(), p.z()};
}
inline Vec3 to_float(const Point& p) {
  return {float(p[0]), float(p[1]), float(p[2])};
}
inline Point to_double(Vec3 p) {
  return {double(p.x), double(p.y), double(p.z)};
}

inline Eigen::Vector3d random_direction(Random& random) {
  const std::array<double, 9> turn = random.rotation();
  return {turn[0], turn[1], turn[2]};
}

/// Random places of a body.
class Places {
 public:
  explicit Places(const Subject& subject) : subject_(subject), s_(subject.asset.info().voxel_size) {
    double sum = 0;
    for (const auto& [a, b, c] : subject.mesh.triangles) {
      const Eigen::Vector3d p = corner(a);
      sum += (corner(b) - p).cross(corner(c) - p).norm();
      areas_.push_back(sum);
    }
  }
  [[nodiscard]] double voxel() const { return s_; }

  /// On the surface: evenly by area, and a third on edges of triangles, where most bounds are met.
  [[nodiscard]] Point on_surface(Random& random) const {
    const auto found = std::upper_bound(areas_.begin(), areas_.end(), random.next() * areas_.back());
    const auto& t = subject_.mesh.triangles[std::min(std::size_t(found - areas_.begin()), areas_.size() - 1)];
    const double root = std::sqrt(random.next());
    const double part = random.next();
    if (random.next() < 1.0 / 3) return point_of(corner(t[0]) + part * (corner(t[1]) - corner(t[0])));
    return point_of((1 - root) * corner(t[0]) + root * (1 - part) * corner(t[1]) + root * part * corner(t[2]));
  }
  /// Half near the surface, at most `reach` from it; half anywhere in the grid and a little beyond.
  [[nodiscard]] Point anywhere(Random& random, double reach) const {
    if (random.next() < 0.5) return near_surface(random, reach);
    const AssetInfo& info = subject_.asset.info();
    Point p{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double length = info.dims[axis] * s_;
      p[axis] = info.origin[axis] + random.between(-0.2, 1.2) * length;
    }
    return p;
  }
  [[nodiscard]] Point near_surface(Random& random, double reach) const {
    return point_of(vector_of(on_surface(random)) + random.between(0, reach) * random_direction(random));
  }
  /// A step of 1 is a voxel long.
  [[nodiscard]] Point beside(const Point& p, double step, Random& random) const {
    return point_of(vector_of(p) + step * s_ * random.next() * random_direction(random));
  }
  [[nodiscard]] Point beside_on_surface(const Point& p, double step, Random& random) const {
    return subject_.surface.closest(beside(p, 4 * step, random));
  }

 private:
  [[nodiscard]] Eigen::Vector3d corner(std::uint32_t vertex) const { return vector_of(subject_.mesh.vertices[vertex]); }
  const Subject& subject_;
  double s_;
  std::vector<double> areas_;  // doubled, of all triangles up to this one
};

/// A body beside a copy of itself, with a place of its surface that is near the copy.
struct Meeting {
  Pose pose;  ///< shell_to_field
  Point at{};
};

inline Pose pose_of(const Eigen::Matrix3d& turn, const Eigen::Vector3d& move) {
  Pose pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation[3 * i + j] = turn(i, j);
    pose.translation[i] = move[i];
  }
  return pose;
}
inline Eigen::Matrix3d turn_of(const Pose& pose) {
  Eigen::Matrix3d turn;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) turn(i, j) = pose.rotation[3 * i + j];
  }
  return turn;
}

/// Places of both surfaces meet, up to `reach` from each other.
inline Meeting meet(const Places& places, double reach, Random& random) {
  const std::array<double, 9> r = random.rotation();
  Eigen::Matrix3d turn;
  turn << r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8];
  // A quarter has parallel faces, as bodies at rest do.
  if (random.next() < 0.25) turn = Eigen::Matrix3d::Identity();
  Meeting out;
  out.at = places.on_surface(random);
  const Eigen::Vector3d there =
      vector_of(places.on_surface(random)) + random.between(0, reach) * random_direction(random);
  out.pose = pose_of(turn, there - turn * vector_of(out.at));
  return out;
}
/// A step of 1 moves the body by up to two voxels, and turns it about the place by up to a tenth of a radian.
inline Meeting beside(const Places& places, const Meeting& m, double step, Random& random) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.1 * step * random.between(-1, 1), random_direction(random)).toRotationMatrix() *
      turn_of(m.pose);
  const Eigen::Vector3d there =
      vector_of(moved(m.pose, m.at)) + 2 * step * places.voxel() * random.next() * random_direction(random);
  Meeting out;
  out.at = random.next() < 0.5 ? m.at : places.beside_on_surface(m.at, step, random);
  out.pose = pose_of(turn, there - turn * vector_of(m.at));
  return out;
}

}  // namespace vps::test
