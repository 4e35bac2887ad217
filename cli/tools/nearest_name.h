// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What someone meant who mistyped a name.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace vps::cli {

/// The name that takes the fewest edits (Levenshtein 1966); of several the first, so that the most usual go first.
/// @return nothing when all of them would take too many to be meant
[[nodiscard]] std::optional<std::string> nearest_name(std::string_view mistyped, const std::vector<std::string>& names);

}  // namespace vps::cli
