// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shows the progress of a long command.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <string>

#include "cli/terminal/terminal.h"

namespace vps::cli {

/// One line on a terminal, rewritten in place and cut to its width. Shows nothing where stderr takes no escape
/// sequences. Not thread-safe.
class Progress {
 public:
  /// @param fraction  done, 0 to 1
  void show(const std::string& stage, double fraction) const {
    if (!terminal_) return;
    // A line that wraps could not be erased.
    const auto width = static_cast<std::size_t>(columns_of(STDERR_FILENO) - 1);
    fmt::print(stderr, "\r\033[K{}", fmt::format("{:>3.0f} % {}", 100 * fraction, stage).substr(0, width));
  }
  void clear() const {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }
  ~Progress() { clear(); }

 private:
  bool terminal_ = takes_escapes(STDERR_FILENO);
};

}  // namespace vps::cli
