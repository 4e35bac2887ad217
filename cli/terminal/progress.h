// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Shows the progress of a long command.
#pragma once

#include <memory>
#include <string>

#include "cli/terminal/verbosity.h"

namespace vps::cli {

/// One line on a terminal, rewritten in place four times a second and cut to its width, 99 columns at most: "distances
/// 55 %, 12 s left". Shows nothing where stderr takes no escape sequences.
class Progress {
 public:
  /// @param verbosity  quiet: shows nothing
  explicit Progress(Verbosity verbosity = Verbosity::usual);
  ~Progress();  ///< erases the line
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// From any thread.
  /// @param what  is being done, in a user's words
  /// @param fraction  done of the whole command, 0 to 1; 0 where it is not known: then the line has the time since the
  ///     first call
  void show(const std::string& what, double fraction) const;
  /// Erases the line until the next `show`.
  void clear() const;

 private:
  struct Line;
  std::unique_ptr<Line> line_;  // null: nothing is shown
};

}  // namespace vps::cli
