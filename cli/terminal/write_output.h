// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Writes output files and reports the result. The name "-" is standard output.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace vps::cli {

/// Where messages about an output go: to standard error where the output itself goes to standard output.
[[nodiscard]] std::FILE* messages_beside(const std::filesystem::path& output);

/// Writes a file whole or not at all. @throw WriteError; std::system_error for standard output
void write_bytes(const std::filesystem::path& output, std::span<const std::byte> bytes);

/// The same for a text; prints an error in one line. @return kOk or kIo
[[nodiscard]] int write_quietly(const std::filesystem::path& output, std::string_view bytes);

/// The same, and prints the file's name and size. @return kOk or kIo
[[nodiscard]] int write_output(const std::filesystem::path& output, std::string_view bytes);

}  // namespace vps::cli
