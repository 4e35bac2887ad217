// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/scene/toml_table.h"

#include <algorithm>

#include "cli/terminal/units.h"
#include "cli/tools/nearest_name.h"

namespace vps::cli {

std::string Table::text(const char* key, const std::string& otherwise) {
  const toml::node* const node = take(key);
  return node == nullptr ? otherwise : text_of(key, *node);
}

bool Table::quantity(const char* key, Parser parse, double& out) {
  const toml::node* const node = take(key);
  if (node != nullptr) out = parsed(key, *node, parse);
  return node != nullptr;
}

bool Table::quantities(const char* key, Parser parse, Triple& out) {
  const toml::node* const node = take(key);
  if (node == nullptr) return false;
  const toml::array* const list = node->as_array();
  if (list == nullptr || list->size() != 3) refuse(*node, fmt::format("{} is a list of three, for x, y and z", key));
  for (std::size_t i = 0; i < 3; ++i) out[i] = parsed(key, *list->get(i), parse);
  return true;
}

bool Table::number(const char* key, double low, double high, double& out) {
  const toml::node* const node = take(key);
  if (node == nullptr) return false;
  const auto value = node->is_number() ? node->value<double>() : std::nullopt;
  if (!value || !(*value >= low && *value <= high))
    refuse(*node, fmt::format("{} is a number from {} to {}, without quotes", key, low, high));
  out = *value;
  return true;
}

void Table::allow_only(const std::vector<std::string>& keys) const {
  for (const auto& [key, node] : table_) {
    const std::string name(key.str());
    if (std::find(keys.begin(), keys.end(), name) != keys.end()) continue;
    const std::optional<std::string> meant = nearest_name(name, keys);
    throw SceneError({file_, static_cast<int>(key.source().begin.line)},
                     fmt::format("{} has no key '{}' here; {}", name_, name,
                                 meant ? fmt::format("did you mean '{}'?", *meant) : "see docs/scene.md for the keys"));
  }
}

void Table::finish() const {
  for (const auto& [key, node] : table_) {
    if (taken_.count(std::string(key.str())) > 0) continue;
    throw SceneError(
        {file_, static_cast<int>(key.source().begin.line)},
        fmt::format("'{}' means nothing beside the other keys of this {}; leave it out", key.str(), name_));
  }
}

std::string Table::text_of(const char* key, const toml::node& node) const {
  const auto* const value = node.as_string();
  if (value == nullptr) refuse(node, fmt::format("{} is a text, in quotes, with a unit where it is a quantity", key));
  return value->get();
}

double Table::parsed(const char* key, const toml::node& node, Parser parse) const {
  try {
    return parse(text_of(key, node));
  } catch (const UsageError& error) {
    refuse(node, fmt::format("{}: {}", key, error.what()));
  }
}

}  // namespace vps::cli
