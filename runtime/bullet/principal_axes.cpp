// SPDX-License-Identifier: Zlib
// Diagonalizes a tensor of inertia by Jacobi's method, and chooses among the equivalent axes.
#include "runtime/bullet/principal_axes.h"

#include <algorithm>
#include <cmath>

namespace vps::bullet {
namespace {

constexpr btScalar kSameMoment = btScalar(1e-5);  // of the largest: a mesh's file is rounded, too

btScalar trace(const btVector3 (&axes)[3]) {
  return axes[0].x() + axes[1].y() + axes[2].z();
}

// Any two perpendicular axes in a plane of equal moments are principal. Turns a pair towards axes i and j.
void turn_in_plane(btVector3& a, btVector3& b, int i, int j) {
  const btScalar angle = btAtan2(b[i] - a[j], a[i] + b[j]);
  const btVector3 turned = btCos(angle) * a + btSin(angle) * b;
  b = btCos(angle) * b - btSin(angle) * a;
  a = turned;
}

// Moment of inertia about an axis.
double moment(const std::array<double, 6>& tensor, const btVector3& axis) {
  const double x = double(axis.x());
  const double y = double(axis.y());
  const double z = double(axis.z());
  return tensor[0] * x * x + tensor[1] * y * y + tensor[2] * z * z +
         2 * (tensor[3] * x * y + tensor[4] * x * z + tensor[5] * y * z);
}

}  // namespace

PrincipalAxes find_principal_axes(const std::array<double, 6>& tensor) {
  PrincipalAxes result{btMatrix3x3::getIdentity(), {tensor[0], tensor[1], tensor[2]}};
  const double largest = std::max({tensor[0], tensor[1], tensor[2]});
  if (!(largest > 0) || (tensor[3] == 0 && tensor[4] == 0 && tensor[5] == 0)) return result;
  const auto entry = [&](std::size_t i) { return static_cast<btScalar>(tensor[i] / largest); };
  btMatrix3x3 diagonal(entry(0), entry(3), entry(4), entry(3), entry(1), entry(5), entry(4), entry(5), entry(2));
  btMatrix3x3 found;
  diagonal.diagonalize(found, SIMD_EPSILON, 20);
  const auto are_equal = [&](int a, int b) { return btFabs(diagonal[a][a] - diagonal[b][b]) < kSameMoment; };

  btScalar best = are_equal(0, 1) && are_equal(1, 2) && are_equal(0, 2) ? 3 : -2;  // no rotation has a smaller trace
  int order[3] = {0, 1, 2};
  do {
    for (int signs = 0; signs < 4; ++signs) {
      btVector3 axes[3];
      for (int i = 0; i < 2; ++i) axes[i] = (signs >> i & 1 ? -1 : 1) * found.getColumn(order[i]);
      axes[2] = axes[0].cross(axes[1]);
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3;
        if (are_equal(order[i], order[j])) turn_in_plane(axes[i], axes[j], i, j);
      }
      if (!(trace(axes) > best + SIMD_EPSILON)) continue;
      best = trace(axes);
      for (int i = 0; i < 3; ++i) {
        result.moments[std::size_t(i)] = moment(tensor, axes[i]);
        for (int row = 0; row < 3; ++row) result.rotation[row][i] = axes[i][row];
      }
    }
  } while (std::next_permutation(order, order + 3));
  return result;
}

}  // namespace vps::bullet
