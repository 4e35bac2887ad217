// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Which files an asset was made of, as make and ninja read it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vps::cli {

/// "target: file file", escaped as compilers do it.
/// @param files  what is not there is left out
[[nodiscard]] std::string depfile_text(const std::filesystem::path& target, std::vector<std::filesystem::path> files);

/// Why a depfile cannot be written, as far as that can be told before the bake; empty when it can.
/// @param targets  that are written; the first is the rule's
/// @param files    that it would list; a depfile replaces none of them, nor the targets
[[nodiscard]] std::string depfile_refusal(const std::filesystem::path& depfile,
                                          const std::vector<std::filesystem::path>& targets,
                                          const std::vector<std::filesystem::path>& files);

}  // namespace vps::cli
