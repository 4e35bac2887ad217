// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A solid with known volume, area and inside, and checks of its asset against them.
#pragma once

#include <functional>

#include "bake/vps_bake.h"
#include "formats/triangle_mesh.h"

namespace vps::test {

using namespace bake;

using Inside = std::function<bool(const std::array<double, 3>&)>;

/// A solid whose volume, area and inside are known without vpsbake.
struct Solid {
  TriangleMesh mesh;
  Inside inside;  ///< of points off the surface
  double volume = 0, area = 0;
};

struct Box {
  std::array<double, 3> half, centre;
  [[nodiscard]] bool holds(const std::array<double, 3>& p) const {
    bool in = true;
    for (std::size_t axis = 0; axis < 3; ++axis) in = in && std::abs(p[axis] - centre[axis]) < half[axis];
    return in;
  }
  [[nodiscard]] double volume() const { return 8 * half[0] * half[1] * half[2]; }
  [[nodiscard]] double area() const { return 8 * (half[0] * half[1] + half[1] * half[2] + half[2] * half[0]); }
};

/// Boxes that may touch; the caller corrects volume and area where they overlap.
[[nodiscard]] Solid solid_of(const std::vector<Box>& boxes);

/// A closed mesh without intersections: volume, area and inside come from its triangles.
[[nodiscard]] Solid solid_of(const TriangleMesh& mesh);

/// Bakes the solid and checks volume, area, samples, layers, queries, pointshell and spheres.
void expect_right(const Solid& solid, double voxel_size, double sheet_thickness = 0);

}  // namespace vps::test
