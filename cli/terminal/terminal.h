// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a terminal supports: escape sequences, colours, its width.
#pragma once

#ifndef VPS_TERMINAL
#error "libraries neither print nor read command lines: link vps_terminal only to programs"
#endif

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string_view>

namespace vps::cli {

/// Whether a stream is a terminal that understands escape sequences; TERM=dumb does not.
[[nodiscard]] inline bool takes_escapes(int fd) {
  const char* const term = std::getenv("TERM");
  return ::isatty(fd) != 0 && term != nullptr && *term != '\0' && std::string_view(term) != "dumb";
}

/// Whether colours are wanted there: NO_COLOR is unset or empty, see no-color.org.
[[nodiscard]] inline bool takes_colour(int fd) {
  const char* const refused = std::getenv("NO_COLOR");
  return (refused == nullptr || *refused == '\0') && takes_escapes(fd);
}

/// Columns of the terminal. Where the stream is no terminal: COLUMNS of the environment, or 80.
[[nodiscard]] inline int columns_of(int fd) {
  winsize size{};
  if (::ioctl(fd, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  const char* const columns = std::getenv("COLUMNS");
  const int number = columns != nullptr ? std::atoi(columns) : 0;
  return number > 0 ? number : 80;
}

}  // namespace vps::cli
