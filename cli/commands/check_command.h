// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake check MESH`: says what is wrong with a mesh and whether it would bake.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

/// Takes the mesh, grid and repair options of a bake. Exits with 0 when the mesh would bake, with 3 when not.
[[nodiscard]] Command add_check_command(CLI::App& app);

}  // namespace vps::cli
