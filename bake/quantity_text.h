// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Lengths and sizes as text, for messages.
#pragma once

#include <string>

namespace vps::bake {

/// "0.5 mm", "3.2 m": a length with the unit that suits it.
[[nodiscard]] std::string format_length(double metres);
/// "12 MB", in powers of 1000.
[[nodiscard]] std::string format_bytes(double bytes);

}  // namespace vps::bake
