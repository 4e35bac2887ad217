// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Two numbers for a message that says that one is larger.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

namespace vps::cli {

/// Both numbers with `digits` significant digits, or with as many more as make the texts of different numbers differ.
[[nodiscard]] inline std::pair<std::string, std::string> differing_numbers(double a, double b, int digits) {
  constexpr int kMost = 17;  // of a double
  std::pair<std::string, std::string> texts;
  do {
    texts = {fmt::format("{:.{}g}", a, digits), fmt::format("{:.{}g}", b, digits)};
  } while (texts.first == texts.second && ++digits <= kMost);
  return texts;
}

}  // namespace vps::cli
