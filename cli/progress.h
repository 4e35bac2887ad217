// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What a long command is doing, for people who wait.
#pragma once

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <string>

namespace vps::cli {

/// One line on a terminal, rewritten in place and cut to its width; nothing when stderr is piped. For one thread.
class Progress {
 public:
  /// @param fraction  done, 0 to 1
  void show(const std::string& stage, double fraction) const {
    if (!terminal_) return;
    winsize size{};
    // A line that wraps could not be taken back.
    const std::size_t width = ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
    fmt::print(stderr, "\r\033[K{}", fmt::format("{:>3.0f} % {}", 100 * fraction, stage).substr(0, width - 1));
  }
  void clear() const {
    if (terminal_) fmt::print(stderr, "\r\033[K");
  }
  ~Progress() { clear(); }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
};

}  // namespace vps::cli
