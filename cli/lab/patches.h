// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A tree of bounding balls over the triangles of a body's surface, for searches by the oracle.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "formats/triangle_mesh.h"
#include "runtime/vps_runtime.h"

namespace vps::lab {

using Point = std::array<double, 3>;  ///< [m]

inline double distance(const Point& a, const Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

inline Point between(const Point& a, const Point& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

inline Point moved(const Pose& pose, const Point& p) {
  Point out;
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = pose.translation[i];
    for (std::size_t j = 0; j < 3; ++j) out[i] += pose.rotation[3 * i + j] * p[j];
  }
  return out;
}

/// A triangle and its bounding ball.
struct Patch {
  std::array<Point, 3> corners{};
  Point centre{};
  double radius = 0;
  explicit Patch(const std::array<Point, 3>& c) : corners(c) {
    for (std::size_t axis = 0; axis < 3; ++axis) centre[axis] = (c[0][axis] + c[1][axis] + c[2][axis]) / 3;
    for (const Point& corner : c) radius = std::max(radius, distance(centre, corner));
  }
  /// Two halves, cut at the middle of the longest side, so that slivers get shorter first.
  [[nodiscard]] std::array<Patch, 2> halves() const {
    std::size_t at = 0;
    for (std::size_t i = 1; i < 3; ++i) {
      if (side(i) > side(at)) at = i;
    }
    const Point& from = corners[at];
    const Point& to = corners[(at + 1) % 3];
    const Point& apex = corners[(at + 2) % 3];
    const Point middle = between(from, to);
    return {Patch({from, middle, apex}), Patch({middle, to, apex})};
  }

 private:
  [[nodiscard]] double side(std::size_t i) const { return distance(corners[i], corners[(i + 1) % 3]); }
};

/// Each ball bounds a group of triangles and its two children the halves of the group, down to single triangles. Ball 0
/// bounds the whole body.
class PatchTree {
 public:
  struct Ball {
    Point centre{};
    double radius = 0;
    std::size_t first = 0;             ///< patch, of a leaf
    std::size_t children[2] = {0, 0};  ///< 0: a leaf
  };

  /// @pre the body has triangles
  explicit PatchTree(const TriangleMesh& body) {
    for (const auto& [a, b, c] : body.triangles) {
      patches_.emplace_back(std::array<Point, 3>{body.vertices[a], body.vertices[b], body.vertices[c]});
    }
    build(0, patches_.size());
  }
  [[nodiscard]] const Ball& ball(std::size_t at) const { return balls_[at]; }
  [[nodiscard]] const Patch& patch(const Ball& leaf) const { return patches_[leaf.first]; }

 private:
  std::size_t build(std::size_t first, std::size_t last) {
    const std::size_t at = balls_.size();
    balls_.emplace_back();
    Point low = patches_[first].centre;
    Point high = low;
    for (std::size_t i = first; i < last; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], patches_[i].centre[axis]);
        high[axis] = std::max(high[axis], patches_[i].centre[axis]);
      }
    }
    Ball ball;
    ball.first = first;
    ball.centre = between(low, high);
    for (std::size_t i = first; i < last; ++i) {
      ball.radius = std::max(ball.radius, distance(ball.centre, patches_[i].centre) + patches_[i].radius);
    }
    if (last - first > 1) {
      std::size_t longest = 0;
      for (std::size_t axis = 1; axis < 3; ++axis) {
        if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
      }
      const std::size_t middle = (first + last) / 2;
      std::nth_element(patches_.begin() + std::ptrdiff_t(first), patches_.begin() + std::ptrdiff_t(middle),
                       patches_.begin() + std::ptrdiff_t(last),
                       [longest](const Patch& a, const Patch& b) { return a.centre[longest] < b.centre[longest]; });
      ball.children[0] = build(first, middle);
      ball.children[1] = build(middle, last);
    }
    balls_[at] = ball;
    return at;
  }

  std::vector<Patch> patches_;
  std::vector<Ball> balls_;
};

}  // namespace vps::lab
