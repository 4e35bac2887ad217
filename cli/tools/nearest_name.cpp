// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/nearest_name.h"

#include <algorithm>
#include <cstddef>

namespace vps::cli {
namespace {

std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

}  // namespace

std::optional<std::string> nearest_name(std::string_view mistyped, const std::vector<std::string>& names) {
  constexpr std::size_t kLongest = 100;  // a longer text is no mistyped name
  if (mistyped.size() > kLongest) return std::nullopt;
  const std::size_t dashes = std::min(mistyped.find_first_not_of('-'), mistyped.size());
  constexpr std::size_t kBeginning = 3;  // letters that may stand for the whole name
  if (mistyped.size() >= dashes + kBeginning) {
    const auto begun =
        std::find_if(names.begin(), names.end(), [&](const auto& name) { return name.starts_with(mistyped); });
    if (begun != names.end()) return *begun;
  }
  const auto nearest = std::min_element(names.begin(), names.end(), [&](const auto& a, const auto& b) {
    return edits_between(mistyped, a) < edits_between(mistyped, b);
  });
  if (nearest == names.end()) return std::nullopt;
  const std::size_t letters = nearest->size() - std::min(dashes, nearest->size());
  if (edits_between(mistyped, *nearest) > 1 + letters / 3) return std::nullopt;
  return *nearest;
}

}  // namespace vps::cli
