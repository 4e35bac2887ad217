// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Open surfaces in a mesh with closed ones. Inside a solid they bound no volume. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

struct OpenSheets {
  std::uint32_t dropped = 0;      ///< open pieces inside the solid
  std::uint32_t outside = 0;      ///< kept: wholly outside the solid, or in one of its cavities
  std::uint32_t crossing = 0;     ///< kept: cross or touch the solid's surface
  Vector place = Vector::Zero();  ///< a place on a kept piece, on a crossing one if there is any. [m]
};

/// Drops every open piece inside the solid that the closed pieces bound after `resolve_shells`. Changes nothing in a
/// mesh without closed pieces.
/// @pre no triangle uses a vertex twice
OpenSheets drop_enclosed_sheets(Mesh& mesh);

}  // namespace vps::bake
