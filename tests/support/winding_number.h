// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Generalized winding number by solid angles. It separates inside from outside even where surfaces intersect,
/// but not for points on the surface.
#pragma once

#include <array>
#include <cmath>
#include <numbers>

#include "formats/triangle_mesh.h"

namespace vps::test {

/// Sum of the triangles' signed solid angles over 4 pi (Van Oosterom and Strackee 1983): how often the surface winds
/// round the point. For closed meshes it is an integer up to rounding.
inline double winding_number(const TriangleMesh& mesh, const std::array<double, 3>& p) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    double v[3][3];
    double length[3];
    for (std::size_t k = 0; k < 3; ++k) {
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        v[k][axis] = mesh.vertices[t[k]][axis] - p[axis];
        squared += v[k][axis] * v[k][axis];
      }
      length[k] = std::sqrt(squared);
    }
    const auto dot = [&](int i, int j) { return v[i][0] * v[j][0] + v[i][1] * v[j][1] + v[i][2] * v[j][2]; };
    const double det = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) +
                       v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
                       v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
    const double real =
        length[0] * length[1] * length[2] + dot(0, 1) * length[2] + dot(1, 2) * length[0] + dot(2, 0) * length[1];
    sum += std::atan2(det, real);
  }
  return sum / (2 * std::numbers::pi);
}

}  // namespace vps::test
