// SPDX-License-Identifier: GPL-3.0-or-later
/// @file What JUnit reports have in common.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace vps::xml {

/// What the reports start with, so that nothing else is replaced by one.
inline constexpr const char* kJUnitBeginning = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n";

/// As an attribute or text of XML 1.0, which has no control characters.
[[nodiscard]] std::string escaped(const std::string& text);

/// File names may hold any bytes, XML may not.
[[nodiscard]] std::string with_utf8_alone(const std::string& text);

/// "machine.processor" and what is beside it, as a suite's properties.
[[nodiscard]] std::string properties(const nlohmann::ordered_json& provenance);

}  // namespace vps::xml
