// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The options that say how a mesh is baked: those of the command without a name, and of batches.
#pragma once

#include <CLI/CLI.hpp>

#include "cli/terminal/bake_arguments.h"

namespace vps::cli {

/// All that decides an asset's bytes besides the mesh, and the limits of reading it.
void add_bake_options(CLI::App& app, BakeArguments& arguments);

/// What CLI11 cannot check: the grid is given, and no option is about a part that is not baked.
/// @throw CLI::ParseError
void require_bakeable(const CLI::App& app, const BakeArguments& bake);

}  // namespace vps::cli
