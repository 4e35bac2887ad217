// SPDX-License-Identifier: GPL-3.0-or-later
/// @file An asset's scalars and sections as JSON and as text, shared by the commands.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "formats/vps_format.h"

namespace vps::cli {

/// Lengths in metres, as in the file. Keys are the field names of AssetInfo.
[[nodiscard]] nlohmann::ordered_json info_to_json(const AssetInfo& info);

/// Two spaces of indentation; bytes that are not UTF-8 are replaced.
[[nodiscard]] std::string to_text(const nlohmann::ordered_json& json);

/// Several lines for people, units included.
[[nodiscard]] std::string info_to_text(const AssetInfo& info);

/// Name of a section as in docs/format.md; "unknown" for kinds of a later version.
[[nodiscard]] const char* section_name(SectionKind kind);
[[nodiscard]] const char* element_name(ElementType type);

}  // namespace vps::cli
