// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Depfiles: the files that an asset was made of, for make and ninja.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vps::cli {

/// "target: file file", escaped as compilers do it.
/// @param files  missing files are left out
[[nodiscard]] std::string depfile_text(const std::filesystem::path& target, std::vector<std::filesystem::path> files);

/// Why a depfile cannot be written, checked before the bake; empty when it can.
/// @param targets  files that are written; the first is the rule's target
/// @param files    files that it would list; a depfile replaces neither these nor the targets
[[nodiscard]] std::string depfile_refusal(const std::filesystem::path& depfile,
                                          const std::vector<std::filesystem::path>& targets,
                                          const std::vector<std::filesystem::path>& files);

}  // namespace vps::cli
