// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How sections appear in the HDF5 file: paths, units, meanings. docs/internals/format.md has the same table.
/// Internal.
#pragma once

#include "formats/vps_format.h"

namespace vps::detail {

struct SectionName {
  SectionKind kind;
  const char* path;
  const char* unit;
  const char* meaning;
  const char* equation;  ///< of Sagardia et al. 2014; empty when none
};

inline constexpr SectionName kSectionNames[] = {
    {SectionKind::brick_index, "/voxelmap/brick_index", "1",
     "number of the stored brick of 8x8x8 voxels; none is stored outside (4294967295) and inside (4294967294)", ""},
    {SectionKind::coarse_layers, "/voxelmap/coarse_layers", "voxel",
     "lower bound of the distance from the centre of each block of 16x16x16 voxels to the surface in whole voxels, "
     "less than 3 below it; positive inside",
     ""},
    {SectionKind::field_roots, "/voxelmap/field_roots", "1",
     "what covers each block of 16x16x16 cells: 2147483648 + number of a node; below it no samples, inside with bit "
     "30, and with bit 29 the number of its octants' planes, else a linear upper bound of V: bits 0 to 20 slopes "
     "along x, y, z in 1/60, 21 to 28 height at the centre in 1/2 voxel; without planes 4294967295 outside, "
     "4294967294 inside",
     ""},
    {SectionKind::field_nodes, "/voxelmap/field_nodes", "1",
     "what covers each octant of a node, x fastest: 2147483648 + number of a node; no samples outside (4294967295) "
     "and inside (4294967294); else a field brick: bits 0 to 23 number of its first slice, 24 and 25 how many slices"
     " are left out, 26 at the lower end, 27 and 28 the slices' axis (0 z, 1 y, 2 x), 29 and 30 level above -2",
     ""},
    {SectionKind::layers, "/voxelmap/layers", "voxel", "layer v of each voxel: 0 surface, positive inside",
     "Eq. (4), sigma = s"},
    {SectionKind::scaled, "/voxelmap/scaled", "lambda",
     "penetration at the samples of field bricks, in slices of 5x5, in steps of lambda, at level 1 of 2 lambda; "
     "positive inside",
     "Eq. (1)"},
    {SectionKind::real, "/voxelmap/real", "m",
     "penetration at the samples of field bricks, in slices of 5x5; positive inside", "Eq. (5)"},
    {SectionKind::real_gradient, "/voxelmap/real_gradient", "m/voxel", "gradient (x, y, z) of real", "Eq. (5)"},
    {SectionKind::far, "/voxelmap/far", "far_step_inner, far_step_outer",
     "penetration at the nodes of a coarse grid, far_origin + far_spacing (x, y, z); values above 0 count in "
     "far_step_inner, below 0 in far_step_outer, and -127 may mean farther outside",
     ""},
    {SectionKind::planes, "/voxelmap/planes", "1",
     "linear upper bound of V in each octant of a root, 8x8x8 cells: bits 0 to 20 the gradient in 1/60, 21 to 30 the"
     " height h at the centre, h |h| / 4096 voxels, 31 whether it also bounds the field a voxel around the octant",
     ""},
    {SectionKind::corners, "/voxelmap/corners", "m", "convex corners and tips of the mesh (x, y, z)", ""},
    {SectionKind::point_positions, "/pointshell/positions", "position_step",
     "rows x, y, z of the points; position = position_origin + position_step * value, in m", "Eq. (6)"},
    {SectionKind::point_inward_normals, "/pointshell/inward_normals", "1/2047",
     "unit normals into the body, octahedral: u and v are the lower and upper 12 bits of three bytes, lowest first, "
     "less 2047; z = 1 - |u| - |v|, t = max(-z, 0), x = u - t sign(u), y = v - t sign(v) with sign(0) = 1, then to "
     "unit length",
     "Eq. (2)"},
    {SectionKind::point_areas, "/pointshell/areas", "area_step",
     "surface area that each point stands for; area = area_step * value^2, in m^2", ""},
    {SectionKind::facet_points, "/pointshell/facet_points", "1",
     "points whose part of the surface is folded, ascending, one entry per facet", ""},
    {SectionKind::facet_corners, "/pointshell/facet_corners", "covering_radius/112",
     "four corners (x, y, z) of each facet less the position of its point, counter-clockwise seen from outside", ""},
    {SectionKind::face_points, "/pointshell/face_points", "1",
     "bit i % 32 of word i / 32: whether point i lies inside a face, where the points are thinned out", ""},
    {SectionKind::spheres, "/pointshell/tree/spheres", "position_step",
     "rows x, y, z, radius of the sphere round all points of a node; centre = position_origin + position_step * "
     "value, radius = position_step * value, in m",
     "Eq. (6)"},
    {SectionKind::children, "/pointshell/tree/children", "1",
     "first child of each node; on the leaf level number of nodes + number of the first point; number of both last",
     "Eq. (6)"},
    {SectionKind::parent_points, "/pointshell/tree/parent_points", "1", "point that represents a node", "Eq. (6)"},
    {SectionKind::level_offsets, "/pointshell/tree/level_offsets", "1",
     "first node of each level, root first; number of nodes last", "Eq. (6)"},
    {SectionKind::hull_offsets, "/pointshell/tree/hull_offsets", "1",
     "where the corners of each node's hull begin; number of corners last. Nodes that are not flat have none", ""},
    {SectionKind::hull_points, "/pointshell/tree/hull_points", "1",
     "points that are corners of the convex hulls of flat nodes, ascending within a node", ""},
    {SectionKind::record, "/record", "1",
     "text in UTF-8, one 'name value' per line: the settings and the hashes of the files that the asset was baked from",
     ""},
};

}  // namespace vps::detail
