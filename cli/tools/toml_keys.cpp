// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/toml_keys.h"

#include <algorithm>
#include <string>

namespace vps::cli {
namespace {

// Where the string that begins at `from` ends: behind its closing quotes, or at the end of the line or of the text.
std::size_t end_of_string(std::string_view text, std::size_t from) {
  const char quote = text[from];
  const bool has_lines = text.substr(from, 3) == std::string(3, quote);
  std::size_t at = from + (has_lines ? 3 : 1);
  for (; at < text.size(); ++at) {
    if (text[at] == '\\' && quote == '"') {
      ++at;
    } else if (text[at] == '\n' && !has_lines) {
      return at;
    } else if (text[at] == quote && !has_lines) {
      return at + 1;
    } else if (text[at] == quote && text.substr(at, 3) == std::string(3, quote)) {
      // Up to two quotes before the closing ones belong to the string.
      return std::min({text.find_first_not_of(quote, at), at + 5, text.size()});
    }
  }
  return text.size();
}

}  // namespace

int line_of_deep_key(std::string_view toml) {
  constexpr std::string_view kEndsKey = "=,[]{}\n";
  int line = 1;
  int parts = 1;
  for (std::size_t at = 0; at < toml.size();) {
    std::size_t next = at + 1;
    if (toml[at] == '"' || toml[at] == '\'') {
      next = end_of_string(toml, at);
    } else if (toml[at] == '#') {
      next = std::min(toml.find('\n', at), toml.size());
    } else if (toml[at] == '.') {
      if (++parts > kMostKeyParts) return line;
    } else if (kEndsKey.find(toml[at]) != kEndsKey.npos) {
      parts = 1;
    }
    line += static_cast<int>(std::count(toml.begin() + static_cast<std::ptrdiff_t>(at),
                                        toml.begin() + static_cast<std::ptrdiff_t>(next), '\n'));
    at = next;
  }
  return 0;
}

}  // namespace vps::cli
