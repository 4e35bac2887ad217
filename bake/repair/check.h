// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Turns imported triangles into a closed, outward surface, or says why that cannot be. Internal to bake.
#pragma once

#include <string>
#include <vector>

#include "bake/geometry.h"
#include "bake/vps_bake.h"

namespace vps::bake {

struct RepairSettings {
  Repair repair = Repair::automatic;
  double voxel_size = 0;       ///< cracks up to this wide are closed; 0: none. [m]
  double sheet_thickness = 0;  ///< 0: open surfaces stay open. [m]
};

struct RepairOutcome {
  Repair used = Repair::none;
  double filled_share = 0;         ///< of the closed surface's area, in patches that fill holes
  std::vector<std::string> notes;  ///< one sentence for each thing that was changed
};

/// Joins identical positions, drops collapsed and duplicate triangles, rights the winding, closes the mesh with the
/// mildest means that suffices, drops open surfaces inside solids, and resolves its shells (see resolve_shells.h).
/// @throw BakeError when the mesh is flat, not finite, or open in spite of the repair allowed: with the place
[[nodiscard]] Surface check_mesh(const TriangleMesh& mesh, const RepairSettings& settings, RepairOutcome& outcome);

}  // namespace vps::bake
