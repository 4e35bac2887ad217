// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The most likely name for a mistyped one.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vps::cli {

/// The name that begins so, or the one with the fewest edits (Levenshtein 1966); of several the first, so list common
/// names first.
/// @return nothing when every name needs too many edits
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view mistyped, const std::vector<std::string>& names);

}  // namespace vps::cli
