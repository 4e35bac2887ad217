// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Names of files that are written, and whether they may be.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace vps::cli {

/// Why an output cannot be written, as far as that can be told beforehand; empty when it can.
/// @param beginning  bytes that files of its kind begin with: what begins otherwise is not overwritten
/// @param kind       of file, such as "an asset"
[[nodiscard]] std::string output_refusal(const std::filesystem::path& output, std::string_view beginning,
                                         const char* kind);

/// `output_refusal` of an asset.
[[nodiscard]] std::string asset_refusal(const std::filesystem::path& output);

/// The file beside an asset with another ending: parts/gear.vps.hdf to parts/gear.html.
[[nodiscard]] std::filesystem::path beside(const std::filesystem::path& asset, const char* ending);

/// Whether two names mean one file, which need not be there.
[[nodiscard]] bool is_same_place(const std::filesystem::path& a, const std::filesystem::path& b);

/// What an asset is called: its file's name without .vps.hdf.
[[nodiscard]] std::string asset_name(const std::filesystem::path& asset);

}  // namespace vps::cli
