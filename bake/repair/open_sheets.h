// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Open surfaces beside closed ones: those inside a solid bound no volume. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

struct OpenSheets {
  std::uint32_t dropped = 0;      ///< open pieces inside the solid
  std::uint32_t outside = 0;      ///< left: wholly outside of the solid, or in a cavity of it
  std::uint32_t crossing = 0;     ///< left: meet the solid's surface
  Vector place = Vector::Zero();  ///< on a piece that was left, a crossing one if there is any. [m]
};

/// Drops every open piece that lies inside the solid that the closed pieces bound, as `resolve_shells` has it. Nothing
/// happens to a mesh without closed pieces.
/// @pre no triangle uses a vertex twice
OpenSheets drop_enclosed_sheets(Mesh& mesh);

}  // namespace vps::bake
