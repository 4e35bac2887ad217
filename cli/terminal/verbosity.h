// SPDX-License-Identifier: GPL-3.0-or-later
/// @file How much a command prints.
#pragma once

#include <cstdint>

namespace vps::cli {

/// Errors and warnings only, what most users want, or everything.
enum class Verbosity : std::uint8_t { quiet, usual, verbose };

}  // namespace vps::cli
