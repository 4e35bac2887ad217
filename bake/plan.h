// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Chooses the grid before any work is done, and refuses absurd ones. Internal to bake.
#pragma once

#include "bake/grid.h"
#include "bake/vps_bake.h"

namespace vps {

struct GridPlan {
  Grid grid;
  int precision = 0;  ///< p of Eq. (1), chosen if it was automatic
  BakePlan plan;
};

/// @throw BakeError when an option is out of range or the grid does not suit the mesh
[[nodiscard]] GridPlan plan_grid(const Surface& surface, const BakeOptions& options);

/// "0.5 mm", "3.2 m": a length with the unit that suits it.
[[nodiscard]] std::string format_length(double metres);
/// "12 MB", in powers of 1000.
[[nodiscard]] std::string format_bytes(double bytes);

}  // namespace vps
