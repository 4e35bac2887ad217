// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Makes closed shells bound one solid: unites overlaps, keeps cavities, corrects winding. Internal to bake.
#pragma once

#include "bake/repair/self_intersections.h"
#include "bake/repair/topology.h"

namespace vps::bake {

struct ShellCounts {
  std::uint32_t shells = 0;       ///< pieces that are closed by themselves (topology.h)
  std::uint32_t flat = 0;         ///< shells without volume, which are dropped
  std::uint32_t inverted = 0;     ///< turned because they were inside out
  std::uint32_t nested = 0;       ///< shells inside an odd number of others: cavities
  std::uint32_t united = 0;       ///< shells that overlapped or touched others or crossed themselves
  std::size_t intersections = 0;  ///< pairs of triangles
  double righted = 0;             ///< volume of parts of shells that were turned, at least: a share of the rest
  double left_out = 0;            ///< the same of small parts, which are left out
};

/// Unites shells that meet (their solids, not their surfaces). A shell inside another is a cavity, one inside a cavity
/// is solid again, and so on. The input's winding of these shells does not matter. Of a shell that crosses or touches
/// itself large parts that are inside out are turned.
/// @param mesh  every edge balanced, no triangle uses a vertex twice
/// @param pairs   its self-intersections
/// @param pieces  its closed_pieces
/// @return counts; the mesh then has winding number 1 inside and 0 outside
ShellCounts resolve_shells(Mesh& mesh, const std::vector<TrianglePair>& pairs, const Pieces& pieces);

}  // namespace vps::bake
