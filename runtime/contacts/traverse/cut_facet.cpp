// SPDX-License-Identifier: Zlib
// Clips triangles where V changes its sign, and integrates the products of linear functions over the rest.
#include "runtime/contacts/traverse/cut_facet.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "runtime/fields/penetration.h"

namespace vps::detail {
namespace {

// In double: its square is out of the range of floats where a body is larger than the Earth or smaller than an atom.
double size_of(Vec3 v) noexcept {
  const double x{v.x}, y{v.y}, z{v.z};
  return std::sqrt(x * x + y * y + z * z);
}

struct FacetCorner {
  Vec3 at;
  float v;
};

struct FacetSums {
  double v = 0;           // integral of V. [m^3]
  double squared = 0;     // of V^2. [m^4]
  double moment[3] = {};  // of V times the position. [m^4]

  // Adds a triangle with V >= 0.
  void add(const FacetCorner& a, const FacetCorner& b, const FacetCorner& c) noexcept {
    // The integral of the product of two linear functions f and g is A / 12 (sum f sum g + sum (f g)).
    const double share = 0.5 / 12 * size_of(cross(b.at - a.at, c.at - a.at));
    const double sum = double{a.v} + b.v + c.v;
    v += share * 4 * sum;
    squared += share * (sum * sum + double{a.v} * a.v + double{b.v} * b.v + double{c.v} * c.v);
    const auto along = [&](int axis, double pa, double pb, double pc) {
      moment[axis] += share * (sum * (pa + pb + pc) + a.v * pa + b.v * pb + c.v * pc);
    };
    along(0, a.at.x, b.at.x, c.at.x);
    along(1, a.at.y, b.at.y, c.at.y);
    along(2, a.at.z, b.at.z, c.at.z);
  }

  void add_part(const FacetCorner (&triangle)[3]) noexcept {
    FacetCorner part[4];
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const FacetCorner& here = triangle[i];
      const FacetCorner& next = triangle[(i + 1) % 3];
      if (here.v >= 0) part[count++] = here;
      if ((here.v >= 0) != (next.v >= 0)) {
        part[count++] = {here.at + here.v / (here.v - next.v) * (next.at - here.at), 0};
      }
    }
    for (std::size_t i = 2; i < count; ++i) add(part[0], part[i - 1], part[i]);
  }
};

}  // namespace

bool cut_facet(const Vec3 (&corners)[4], const float (&v)[4], Contact& contact) noexcept {
  if (!(std::max({v[0], v[1], v[2], v[3]}) > 0)) return false;
  FacetSums sums;
  for (std::size_t i = 2; i < 4; ++i) {
    // From the first corner, which keeps the products of lengths accurate far from the origin.
    sums.add_part({{{}, v[0]}, {corners[i - 1] - corners[0], v[i - 1]}, {corners[i] - corners[0], v[i]}});
  }
  if (!(sums.squared > 0)) return false;
  const Vec3 inward = cross(corners[3] - corners[1], corners[2] - corners[0]);
  const double size = size_of(inward);
  if (!(size > 0)) return false;
  const auto centre = [&](int axis) { return static_cast<float>(sums.moment[axis] / sums.v); };
  contact.position = corners[0] + Vec3{centre(0), centre(1), centre(2)};
  contact.inward_normal = static_cast<float>(1 / size) * inward;
  contact.penetration = static_cast<float>(sums.squared / sums.v);
  contact.area = static_cast<float>(sums.v * sums.v / sums.squared);
  return true;
}

}  // namespace vps::detail
