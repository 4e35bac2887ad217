// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake check MESH`: says what is wrong with a mesh and whether it would bake.
#pragma once

#include "cli/bake_command.h"

namespace vps::cli {

/// Uses the mesh, grid and repair options of a bake. @return 0 when the mesh would bake, 3 when not
[[nodiscard]] int run_check(const BakeArguments& arguments);

}  // namespace vps::cli
