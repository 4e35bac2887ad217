// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Samples where interpolation errs most: beside creases of the surface, and where the nearest one changes.
/// Internal to bake.
#pragma once

#include "bake/stages/certify.h"

namespace vps::bake {

/// Starts of the search for the largest error, the same for every run. A quarter lie beside sharp edges, spread by
/// length and half a voxel away along each axis at most. The others lie between voxel centres, up to two voxels from
/// the surface, whose nearest triangles face different ways. Large meshes have starts at a part of their edges.
/// @param limit  the samples' largest distance from the surface. [Units: m]
[[nodiscard]] std::vector<CertificateSample> crease_samples(const Distances& distances, const InsideTest& inside,
                                                            const Grid& grid, const BandField& field, double limit);

}  // namespace vps::bake
