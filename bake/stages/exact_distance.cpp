// SPDX-License-Identifier: GPL-3.0-or-later
#include "bake/stages/exact_distance.h"

#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace vps::bake {

double exact_distance(const Surface& surface, const Vector& point, std::span<const std::uint32_t> among) {
  using Kernel = CGAL::Simple_cartesian<double>;
  const auto point3 = [](const Vector& v) { return Kernel::Point_3(v.x(), v.y(), v.z()); };
  const Kernel::Point_3 from = point3(point);
  double least = std::numeric_limits<double>::infinity();
  for (const std::uint32_t t : among) {
    const Kernel::Triangle_3 triangle(point3(surface.corner(t, 0)), point3(surface.corner(t, 1)),
                                      point3(surface.corner(t, 2)));
    const Kernel::Point_3 nearest = Kernel().construct_projected_point_3_object()(triangle, from);
    least = std::min(least, CGAL::squared_distance(from, nearest));
  }
  return std::sqrt(least);
}

}  // namespace vps::bake
