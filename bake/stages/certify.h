// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Measures the error of queries of the stored fields against the mesh. Internal to bake.
#pragma once

#include <algorithm>
#include <functional>

#include "bake/repair/winding.h"
#include "bake/stages/distance_field.h"
#include "bake/stages/triangle_tree.h"

namespace vps::bake {

inline constexpr std::size_t kCertificateSamples = 12000;

/// How many places of a field to measure. A small mesh has few, and measuring each many times finds nothing new.
/// @param each  how often each is measured where there are few
[[nodiscard]] inline std::size_t enough_places(std::size_t places, double each, std::size_t most) {
  const std::size_t few = std::min(2 * places, most / 8);
  return std::clamp(static_cast<std::size_t>(each * static_cast<double>(places)), few, most);
}

/// A point in the band with its true penetration.
struct CertificateSample {
  Vector point = Vector::Zero();
  double penetration = 0;  ///< exact. [m]
};

/// A stored field as a query sees it: V at a point by Eq. (4) or interpolated. [m]
using Reconstruction = std::function<double(const Vector&)>;

/// Whether a point is inside. The surface cannot pass between two points that are closer to each other than the sum of
/// their distances to it: only elsewhere the exact test has to decide.
/// @param least  lower bound of the point's distance. [m]
/// @param known  another point; one on the surface tells nothing
[[nodiscard]] bool is_inside(const InsideTest& inside, const Vector& point, double least,
                             const CertificateSample& known);

/// Both ways to the distance of a point. All values of a certificate are of `exact_distance`, which shares no
/// arithmetic with the field. The tree finds out which points have to be measured, and which triangles may be the
/// nearest.
struct Distances {
  const Surface& surface;
  const TriangleTree& tree;
  double slack = 0;  ///< larger than the difference between the two. [m]

  /// @param about  of the tree, or an upper bound of the distance. [m]
  [[nodiscard]] double exact(const Vector& point, double about) const;
};

/// Points spread evenly over a band, the same for every run. Points within a voxel's half diagonal of the band's end
/// are left out, because their voxel may lie beyond it.
/// @param band_inner, band_outer  no wider than the field's. [Units: m]
[[nodiscard]] std::vector<CertificateSample> certificate_samples(const Distances& distances, const InsideTest& inside,
                                                                 const Grid& grid, const BandField& field,
                                                                 double band_inner, double band_outer);

/// Errors of one field at the samples. The bound is the largest of them.
[[nodiscard]] FieldCertificate certify(const std::vector<CertificateSample>& samples,
                                       const Reconstruction& reconstruct);

/// The true penetration of any point.
struct Truth {
  const Distances& distances;
  const InsideTest& inside;
  double voxel_size = 0;      ///< [m]
  double inner = 0;           ///< the certificate covers -outer <= V <= inner. [m]
  double outer = 0;           ///< [m]
  double least = 0;           ///< and |V| >= least. [m]
  std::size_t starts = 2048;  ///< samples that the search begins from
};

/// Climbs from the worst samples to larger errors, because few samples meet the worst place itself. Puts the largest
/// error into `max` and `worst_at`, and raises `bound` to it.
void find_worst(const std::vector<CertificateSample>& samples, const Reconstruction& reconstruct, const Truth& truth,
                FieldCertificate& certificate);

/// Largest error of V by Eq. (4), for any unit normal and any surface: docs/internals/bounds.md, "Layers". [Units: vx]
/// @param end  the error counts where the true V is at most this far from the surface. [Units: vx]
[[nodiscard]] double layers_error_bound(double end);

}  // namespace vps::bake
