// SPDX-License-Identifier: GPL-3.0-or-later
/// @file `vpsbake scene SCENE`: plans a scene, bakes what its bodies need and nothing else.
#pragma once

#include "cli/terminal/options.h"

namespace vps::cli {

[[nodiscard]] Command add_scene_command(CLI::App& app);

}  // namespace vps::cli
