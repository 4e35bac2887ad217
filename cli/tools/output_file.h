// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Names of output files, and whether they may be written.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace vps::cli {

/// Why an output cannot be written, checked beforehand; empty when it can. Standard output, "-", must be no
/// terminal.
/// @param beginning  first bytes of files of its kind: a file that begins otherwise is not overwritten
/// @param kind       kind of file, such as "an asset"
[[nodiscard]] std::string output_refusal(const std::filesystem::path& output, std::string_view beginning,
                                         const char* kind);

/// `output_refusal` of an asset. It may not have the name of a mesh.
[[nodiscard]] std::string asset_refusal(const std::filesystem::path& output);

/// Makes the folder of a cache where it does not exist. @return why it cannot be made; empty when it exists or no
/// folder is named
[[nodiscard]] std::string cache_refusal(const std::filesystem::path& folder);

/// The file beside an asset with another ending: parts/gear.vps.hdf to parts/gear.html. Beside standard input,
/// "-", is standard output.
[[nodiscard]] std::filesystem::path beside(const std::filesystem::path& asset, const char* ending);

/// Whether two names mean the same file, which need not exist.
[[nodiscard]] bool is_same_place(const std::filesystem::path& a, const std::filesystem::path& b);

/// Name of an asset: its file name without .vps.hdf.
[[nodiscard]] std::string asset_name(const std::filesystem::path& asset);

}  // namespace vps::cli
