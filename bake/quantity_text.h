// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Lengths and sizes as text, for messages.
#pragma once

#include <string>
#include <utility>

namespace vps::bake {

/// "0.5 mm", "3.2 m": a length with the unit that suits it.
[[nodiscard]] std::string format_length(double metres);
/// "12 MB", in powers of 1000.
/// @param digits  significant ones. [Limits: 3 <= value <= 17]
[[nodiscard]] std::string format_bytes(double bytes, int digits = 3);
/// Both sizes as `format_bytes` writes them, with as many digits as make the texts of different sizes differ.
[[nodiscard]] std::pair<std::string, std::string> differing_bytes(double a, double b);

}  // namespace vps::bake
