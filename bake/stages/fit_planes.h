// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Fits linear upper bounds of V: in cells of 8x8x8 voxels, and in blocks of 16x16x16 without samples. Internal
/// to bake.
///
/// Most spheres and points of a query are far enough from the surface for one such bound to reject them. It costs one
/// read or two; an octree's sample costs up to nine. docs/internals/bounds.md, "The planes", has the proof.
#pragma once

#include "bake/stages/pack_sections.h"

namespace vps::bake {

/// What the planes bound.
struct PlaneSource {
  const Surface& surface;
  const Grid& grid;
  const Representations& values;                   ///< with `scaled`
  const std::vector<std::int16_t>& coarse_layers;  ///< of bricks
  double band_inner, band_outer;                   ///< [m]
  double error;                                    ///< of `scaled`. [m]
};

/// Codes: formats/cell_plane.h.
[[nodiscard]] FieldPlanes fit_planes(const PlaneSource& from);

}  // namespace vps::bake
