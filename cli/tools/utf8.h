// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Texts that may hold any bytes, such as names of files.
#pragma once

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>

namespace vps::cli {

/// The text with U+FFFD for bytes that are not UTF-8; the same text when all are.
[[nodiscard]] inline std::string valid_utf8(const std::string& text) {
  using Json = nlohmann::ordered_json;
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

/// The text with '?' for control characters, so that no name breaks a line or acts on a terminal.
[[nodiscard]] inline std::string one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return std::iscntrl(c) != 0; }, '?');
  return text;
}

}  // namespace vps::cli
