// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The stages of a bake in words that a user knows.
#pragma once

#include <string>
#include <string_view>

namespace vps::cli {

/// "distances" for "sample_field". @param stage  as BakeOptions::progress has it, "import" or "done"
[[nodiscard]] std::string stage_words(std::string_view stage);

}  // namespace vps::cli
