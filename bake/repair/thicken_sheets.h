// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Gives open surfaces a thickness. Internal to bake.
#pragma once

#include "bake/geometry.h"

namespace vps::bake {

/// Replaces every piece that has an open edge by a closed shell around it: the piece moved outward and inward by half
/// the thickness, joined by walls along its border. At creases vertices move farther, so that the faces keep their
/// distance, but no more than twice as far. The shells may overlap. @return number of pieces thickened
std::size_t thicken_sheets(Mesh& mesh, double thickness);

}  // namespace vps::bake
