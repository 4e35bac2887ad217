// SPDX-License-Identifier: GPL-3.0-or-later
/// @file The name "-" on the command line: standard input where a command reads a file, standard output where it writes
/// one.
#pragma once

#include <cstddef>
#include <filesystem>
#include <limits>
#include <span>

namespace vps::cli {

[[nodiscard]] inline bool is_standard_stream(const std::filesystem::path& name) {
  return name == "-";
}

/// Of a mesh on standard input.
struct InputLimits {
  std::size_t bytes = std::numeric_limits<std::size_t>::max();
  double seconds = std::numeric_limits<double>::infinity();
};

/// The file to read. For "-" a file in memory with all of standard input, which is read at the first call; a file of
/// that name is "./-".
/// @throw ImportError where standard input is empty, a terminal, exceeds a limit, or cannot be read
[[nodiscard]] std::filesystem::path file_to_read(const std::filesystem::path& name, const InputLimits& limits = {});

/// Writes and flushes all bytes. @throw std::system_error, which `main` reports
void write_to_standard_output(std::span<const std::byte> bytes);

}  // namespace vps::cli
