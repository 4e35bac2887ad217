// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The options of a bake, for `vpsbake MESH` and for batches.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/terminal/bake_arguments.h"

namespace vps::cli {

/// Adds every option that affects an asset's bytes, and the limits of reading the mesh.
void add_bake_options(CLI::App& app, BakeArguments& arguments);

/// Call after parsing: sets the default grid, and checks that no option concerns a part that is not baked.
/// @throw CLI::ParseError
void complete_bake_options(const CLI::App& app, BakeArguments& bake);

}  // namespace vps::cli
