// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The shell command of a bake.
#pragma once

#include <string>

#include "cli/terminal/bake_arguments.h"

namespace vps::cli {

/// The command that bakes a mesh with these options: options at their default are left out.
/// @param arguments  the mesh and how it is read
/// @param options    with a voxel size
[[nodiscard]] std::string bake_command(const BakeArguments& arguments, const bake::BakeOptions& options);

}  // namespace vps::cli
