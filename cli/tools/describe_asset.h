// SPDX-License-Identifier: GPL-3.0-or-later
/// @file An asset's scalars and sections as JSON and as text, shared by the commands.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "runtime/vps_runtime.h"

namespace vps::cli {

/// Lengths in metres, as in the file. Keys are the field names of AssetInfo.
[[nodiscard]] nlohmann::ordered_json info_to_json(const AssetInfo& info);

/// The settings and hashes of an asset's record by name, in its order; numbers in decimal. Values of the same name are
/// joined by spaces. Empty when it has no record.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> record_values(const Asset& asset);

/// The file, its format, size and hash, `info_to_json`, the record and the sections: what `vpsbake info --json` prints.
[[nodiscard]] nlohmann::ordered_json asset_to_json(const std::string& path, const Asset& asset);

/// At most 100 characters of the text, each printable: texts of a forged file may hold anything.
[[nodiscard]] std::string printable(const std::string& text);

/// Two spaces of indentation; bytes that are not UTF-8 are replaced.
[[nodiscard]] std::string to_text(const nlohmann::ordered_json& json);

/// Several lines for people, units included.
[[nodiscard]] std::string info_to_text(const AssetInfo& info);

/// Name of a section as in docs/internals/format.md; "unknown" for kinds of a later version.
[[nodiscard]] const char* section_name(SectionKind kind);
[[nodiscard]] const char* element_name(ElementType type);

}  // namespace vps::cli
