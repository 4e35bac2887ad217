// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Turns imported triangles into a closed, outward surface, or says why that is impossible. Internal to bake.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bake/geometry.h"
#include "bake/vps_bake.h"

namespace vps::bake {

struct RepairSettings {
  Repair repair = Repair::automatic;
  double voxel_size = 0;       ///< cracks up to this width are closed; 0: none. [m]
  double sheet_thickness = 0;  ///< 0: open surfaces stay open. [m]
  /// Called at the start of each long step; may be empty. See `report_steps`.
  std::function<void(const char* step)> progress = nullptr;
};

/// The steps of a check as stages of a bake: "check: unite shells".
[[nodiscard]] std::function<void(const char* step)> report_steps(const BakeOptions& options);

struct RepairOutcome {
  Repair used = Repair::none;
  double filled_share = 0;         ///< share of the closed surface's area that patches over holes have
  std::vector<std::string> notes;  ///< one sentence for each change or warning
};

/// Joins identical positions, drops collapsed and duplicate triangles, corrects the winding, closes the mesh with the
/// least invasive repair that works, drops open surfaces inside solids, and resolves its shells (see resolve_shells.h).
/// @throw BakeError when the mesh is flat or not finite, or is open after the allowed repair: then with the place
[[nodiscard]] Surface check_mesh(const TriangleMesh& mesh, const RepairSettings& settings, RepairOutcome& outcome);

}  // namespace vps::bake
