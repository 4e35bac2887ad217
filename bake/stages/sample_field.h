// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Samples the distance field as densely as interpolation needs. Internal to bake.
///
/// The paper keeps one value per voxel; close to a flat face that is more than needed, next to an edge it is not
/// enough. Adaptively sampled distance fields (Frisken et al. 2000) put samples where trilinear interpolation errs.
/// Here the samples are also fitted, so that interpolation errs to both sides.
#pragma once

#include "bake/loop_progress.h"
#include "bake/repair/winding.h"
#include "bake/stages/distance_field.h"

namespace vps::bake {

/// Largest allowed error of interpolation. In the band's last 0.87 voxels, where a cell may reach beyond it, the error
/// may grow by a quarter of the way into them. Beyond the band only the side is kept.
struct FieldTolerance {
  double error = 0;       ///< [m]
  double band_inner = 0;  ///< [m]
  double band_outer = 0;  ///< [m]
  bool prove = false;     ///< whether an error is accepted only where a bound is proven: FieldTree::proven
};

/// How samples are kept.
struct SampleForm {
  bool real = false;       ///< as `penetration` and `gradient`
  double lambda = 0;       ///< as `scaled` with this step at levels below 1, twice that at level 1; 0: not. [m]
  std::int32_t limit = 0;  ///< largest absolute value in `scaled`
  double band_inner = 0;   ///< a value beyond the band may be stored as less, but not as one in the band. [m]
  double band_outer = 0;   ///< [m]

  [[nodiscard]] double step(int level) const { return level > 0 ? 2 * lambda : lambda; }
};

/// An octree of field bricks. All slices of a brick are there, along z: the asset stores fewer (trim_bricks.h). The
/// roots are without planes.
struct FieldTree {
  Index3 root_dims{};
  std::vector<std::uint32_t> roots;  ///< [rz,ry,rx]
  std::vector<std::uint32_t> nodes;  ///< [N,8]; those of roots first, in their order
  std::size_t bricks = 0;            ///< b
  UnsetVector<double> penetration;   ///< [b,125]: fitted within the field's band, else clamped. [m]
  UnsetVector<float> gradient;       ///< [b,125,3]: zero beyond the band. [m per voxel step]
  UnsetVector<std::int16_t> scaled;  ///< [b,125]: penetration / step, rounded to nearest, clamped at the limit
  double worst_error = 0;            ///< of samples, and of interpolation at the tested places. [m]
  Vector worst_at = Vector::Zero();  ///< [m]
  double proven = 0;                 ///< proven bound of interpolation's error in the band; 0 unless asked for. [m]
};

/// @param field  exact at least one voxel beyond the band of `tolerance`
[[nodiscard]] FieldTree sample_field(const Surface& surface, const Grid& grid, const InsideRuns& runs,
                                     const BandField& field, const InsideTest& inside, const FieldTolerance& tolerance,
                                     const SampleForm& form, const StageProgress& progress = {});

/// The field brick at a point, and the samples that interpolation uses there.
struct FieldCell {
  bool sampled = false;  ///< false beyond the stored bricks
  int level = 0;
  std::size_t samples[8]{};  ///< numbers in the tree's values
  double weights[8]{};
};
[[nodiscard]] FieldCell find_cell(const Grid& grid, const FieldTree& tree, const Vector& p);

}  // namespace vps::bake
