// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Finds keys that a TOML parser cannot take, before it parses.
#pragma once

#include <string_view>

namespace vps::cli {

/// Parts of a dotted key, such as a.b.c, at most. Parsers make a table in a table for each part, and need as much of
/// the stack. Together with the 256 nested inline tables that toml++ allows, tables are at most 4096 deep.
inline constexpr int kMostKeyParts = 16;

/// The first line with a key of more than kMostKeyParts parts; 0: there is none. Follows the text as far as it is TOML.
[[nodiscard]] int line_of_deep_key(std::string_view toml);

}  // namespace vps::cli
