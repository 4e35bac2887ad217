// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/tools/xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace vps::xml {

using nlohmann::ordered_json;

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += std::iscntrl(static_cast<unsigned char>(c)) != 0 && c != '\n' ? '?' : c;
    }
  }
  return out;
}

std::string with_utf8_alone(const std::string& text) {
  return ordered_json::parse(ordered_json(text).dump(-1, ' ', false, ordered_json::error_handler_t::replace))
      .get<std::string>();
}

std::string properties(const ordered_json& provenance) {
  std::string out = "    <properties>\n";
  const ordered_json flat = provenance.flatten();
  for (const auto& [key, value] : flat.items()) {
    std::string name = key.substr(1);  // without the first /
    std::replace(name.begin(), name.end(), '/', '.');
    out += fmt::format("      <property name=\"{}\" value=\"{}\"/>\n", escaped(name),
                       escaped(value.is_string() ? value.get<std::string>() : value.dump()));
  }
  return out + "    </properties>\n";
}

}  // namespace vps::xml
