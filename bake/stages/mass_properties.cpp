// SPDX-License-Identifier: GPL-3.0-or-later
// Mass properties by signed tetrahedra from one reference point (Tonon 2004 gives the moments of a tetrahedron).
#include "bake/stages/mass_properties.h"

namespace vps::bake {

MassProperties mass_properties(const Surface& surface) {
  // The middle of the mesh as reference: far from the origin the moments would lose their digits.
  const Vector reference = (surface.bounds_min + surface.bounds_max) / 2;
  double volume = 0;
  Vector first = Vector::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const Vector a = surface.corner(t, 0) - reference;
    const Vector b = surface.corner(t, 1) - reference;
    const Vector c = surface.corner(t, 2) - reference;
    const double det = a.dot(b.cross(c));
    const Vector sum = a + b + c;
    volume += det / 6;
    first += det / 24 * sum;
    second += det / 120 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  MassProperties mass;
  mass.volume = volume;
  const Vector centre = first / volume;
  mass.centre_of_mass = reference + centre;
  const Eigen::Matrix3d about_centre = second - volume * centre * centre.transpose();
  mass.inertia = about_centre.trace() * Eigen::Matrix3d::Identity() - about_centre;
  return mass;
}

}  // namespace vps::bake
