// SPDX-License-Identifier: Zlib
/// @file Nodes of the shell that are flat, on a sheet that is flat there. Internal.
#pragma once

#include "runtime/bullet/partners/sheet_part.h"

namespace vps::bullet {

/// What the corners of a flat node's hull answer for all points below it.
struct FlatNode {
  const Triangle* plane = nullptr;  ///< the sheet there; null: no answer, the points have to be tested
  float side = 0;                   ///< where the body's material is: 1 along the plane's normal, -1 against it
  bool touches = false;             ///< all corners are contacts; otherwise no point below is one
};

/// The corners of a node's hull: numbers of points. Empty for a node that is not flat.
/// @pre the shell has hulls
inline std::span<const std::uint32_t> hull_of(const PointshellView& shell, std::uint32_t node) noexcept {
  return {shell.hull_points + shell.hull_offsets[node], shell.hull_points + shell.hull_offsets[node + 1]};
}

/// Asks the corners of a flat node's hull. Proof: docs/internals/bounds.md, "Flat nodes".
/// @param part      the triangles within reach of the node's sphere
/// @param distance  at which points are contacts. [m]
/// @param relevant  at which they are remembered, >= distance. [m]
FlatNode ask_flat_node(const SolidBody& body, const SheetPart& part, std::uint32_t node, float distance,
                       float relevant);

}  // namespace vps::bullet
