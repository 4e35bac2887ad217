// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Writes files and says so.
#pragma once

#include <filesystem>
#include <string_view>

namespace vps::cli {

/// Writes the text whole or not at all; what is wrong is said in one line. @return kOk or kIo
[[nodiscard]] int write_quietly(const std::filesystem::path& output, std::string_view bytes);

/// Writes the text whole or not at all, and prints its name and size; what is wrong is said in one line. @return kOk or
/// kIo
[[nodiscard]] int write_output(const std::filesystem::path& output, std::string_view bytes);

}  // namespace vps::cli
