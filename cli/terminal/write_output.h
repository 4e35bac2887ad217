// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Writes output files and reports the result.
#pragma once

#include <filesystem>
#include <string_view>

namespace vps::cli {

/// Writes the text whole or not at all; prints an error in one line. @return kOk or kIo
[[nodiscard]] int write_quietly(const std::filesystem::path& output, std::string_view bytes);

/// Writes the text whole or not at all, and prints the file's name and size, or an error in one line.
/// @return kOk or kIo
[[nodiscard]] int write_output(const std::filesystem::path& output, std::string_view bytes);

}  // namespace vps::cli
