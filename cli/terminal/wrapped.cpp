// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/wrapped.h"

#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "cli/terminal/terminal.h"

namespace vps::cli {

std::string wrapped(const std::string& text, std::size_t width, std::size_t indent) {
  std::string out;
  std::size_t at = indent;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (at > indent && at + 1 + word.size() > width) {
      out += "\n" + std::string(indent, ' ');
      at = indent;
    }
    out += (at > indent ? " " : "") + word;
    at += (at > indent ? 1 : 0) + word.size();
  }
  return out;
}

std::string fitted(const std::string& text, int fd) {
  const auto width = static_cast<std::size_t>(std::clamp(columns_of(fd), 40, 100));
  return ::isatty(fd) == 0 || text.size() <= width ? text : wrapped(text, width, 2);
}

}  // namespace vps::cli
