// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Exit codes of vpsbake.
#pragma once

namespace vps::cli {

// Constants of a plain enum, named as other constants.
// NOLINTBEGIN(readability-identifier-naming)
enum ExitCode : int {
  kOk = 0,
  kCommandLine = 1,  ///< the command line is wrong
  kIo = 2,           ///< a file cannot be read or written
  kBadInput = 3,     ///< the mesh or asset cannot be used
  kInternal = 4,     ///< out of memory, or a defect
  kSomeFailed = 5,   ///< some items of a batch failed
};
// NOLINTEND(readability-identifier-naming)

/// For --help and the manual.
inline constexpr const char* kExitCodes =
    "0 ok, 1 command line, 2 I/O, 3 bad input, 4 internal, 5 some items of a batch failed";

}  // namespace vps::cli
