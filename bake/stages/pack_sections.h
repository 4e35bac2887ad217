// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Makes the representations of the field, and packs all results into sections of the asset. Paper: Eq. (1),
/// Sec. 2.1.1. Internal.
#pragma once

#include <optional>

#include "bake/stages/bounding_spheres.h"
#include "bake/stages/far_field.h"
#include "bake/stages/find_corners.h"
#include "bake/stages/find_hulls.h"
#include "bake/stages/sample_field.h"
#include "bake/vps_bake.h"

namespace vps::bake {

/// The requested fields. The others are empty.
struct Representations {
  std::vector<std::int8_t> layers;  ///< by brick of the band
  FieldTree tree;                   ///< samples of `scaled` and `real`
  SampleForm form;

  [[nodiscard]] bool has_scaled() const { return form.lambda > 0; }
};

[[nodiscard]] Representations represent(const Surface& surface, const Grid& grid, const SurfaceVoxels& voxels,
                                        const InsideRuns& runs, const BandField& field, const InsideTest& inside,
                                        const BakeOptions& options, double lambda, const StageProgress& progress);

void certify_fields(const Surface& surface, const Distances& distances, const InsideTest& inside, const Grid& grid,
                    const BandField& field, const Representations& fields, const BakeOptions& options, AssetInfo& info);

void describe_voxelmap(const Grid& grid, const SurfaceVoxels& voxels, const InsideRuns& runs,
                       const BakeOptions& options, double lambda, AssetInfo& info);
/// Places the far grid behind the coarse layers: other sections must follow it.
void pack_far(const FarField& far, AssetInfo& info, std::vector<SectionData>& sections);
/// The sharpest, if they are more than an asset may have.
void pack_corners(std::vector<Corner> corners, std::vector<SectionData>& sections);
/// Of `coarse_layers`, for edges of kBrickEdge and kCoarseEdge.
struct CoarseBounds {
  const std::vector<std::int16_t>& bricks;
  const std::vector<std::int16_t>& blocks;
};
void pack_voxelmap(const Grid& grid, const BandField& field, const CoarseBounds& coarse, const Representations& fields,
                   std::vector<SectionData>& sections);

/// Of `fit_planes`.
struct FieldPlanes {
  std::vector<std::uint32_t> roots;    ///< the field's roots; those without samples with their planes
  std::vector<std::uint32_t> octants;  ///< [t,8]: codes for octants of roots, those of nodes first
};
/// @pre the sections have the field's roots
void pack_planes(const FieldPlanes& planes, std::vector<SectionData>& sections);

/// @pre info has the mesh's bounds
void describe_pointshell(const Pointshell& shell, const PointTree& tree, std::uint32_t branching, AssetInfo& info);
/// Positions in tree order as queries decode them. The spheres must enclose these.
/// @pre describe_pointshell has filled `info`, here and below
[[nodiscard]] std::vector<Point3f> tree_points(const Pointshell& shell, const PointTree& tree, const AssetInfo& info);
void pack_pointshell(const Pointshell& shell, const PointTree& tree, const std::vector<BoundingSphere>& spheres,
                     const AssetInfo& info, std::vector<SectionData>& sections);
void pack_hulls(const NodeHulls& hulls, std::vector<SectionData>& sections);

}  // namespace vps::bake
