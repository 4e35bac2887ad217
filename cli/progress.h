// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a long command is doing, for people who wait.
#pragma once

#include <fmt/format.h>
#include <unistd.h>

#include <string>

namespace vps::cli {

/// One line on a terminal, rewritten in place; nothing when stderr is piped. For one thread.
class Progress {
 public:
  /// @param fraction  done, 0 to 1
  void show(const std::string& stage, double fraction) const {
    if (terminal_) fmt::print(stderr, "\r\033[K{:>3.0f} % {}", 100 * fraction, stage);
  }
  void clear() const {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }
  ~Progress() { clear(); }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
};

}  // namespace vps::cli
