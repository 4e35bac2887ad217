// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/print.h"

#include "cli/terminal/terminal.h"

namespace vps::cli {

std::string painted(const std::string& text, TextColour colour, int fd) {
  constexpr const char* kCodes[] = {"0", "1", "1;32", "1;33", "1;31"};
  if (colour == TextColour::plain || !takes_colour(fd)) return text;
  return fmt::format("\033[{}m{}\033[0m", kCodes[std::size_t(colour)], text);
}

}  // namespace vps::cli
