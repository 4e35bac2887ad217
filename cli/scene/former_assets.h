// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Assets of an earlier plan that no manifest in their folder names any more.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace vps::cli {

/// Names, without folders, of the assets that a manifest lists; none when it is missing or not a manifest. Names in
/// other folders are left out.
[[nodiscard]] std::set<std::string> assets_of(const std::filesystem::path& manifest);

/// Removes those of `former` that no manifest (*.vps.json) in the folder lists. Only removes assets.
/// @return the names of the removed files
[[nodiscard]] std::vector<std::string> remove_unlisted(const std::filesystem::path& folder,
                                                       const std::set<std::string>& former);

}  // namespace vps::cli
