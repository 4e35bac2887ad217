// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Origin of measured numbers: the data needed to repeat them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

namespace vps::cli {

/// The program's version, and one line for each library's.
[[nodiscard]] std::string version_text();

/// A word for a shell, quoted where necessary.
[[nodiscard]] std::string quoted_word(const std::string& word);

/// Keeps the command line for `provenance`, quoted for a shell.
void remember_command(int argc, char** argv);

/// `machine` (processor, cores, instruction set of the queries, memory, load of the last minute, system; no host name),
/// `versions`, `seed` and `command`.
[[nodiscard]] nlohmann::ordered_json provenance(std::uint64_t seed);

}  // namespace vps::cli
