// SPDX-License-Identifier: GPL-3.0-or-later
/// @file A recorded motion of bodies, docs/motion.md, as cli/tools/view/pages/motion.html plays it.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace vps::cli {

/// Reads a motion and the assets that it names, and makes their surfaces.
/// @throw ImportError that names the fault and its place
[[nodiscard]] nlohmann::ordered_json motion_data(const std::filesystem::path& motion);

}  // namespace vps::cli
