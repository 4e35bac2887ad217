// SPDX-License-Identifier: GPL-3.0-or-later
/// @file Reads a table of a scene in TOML key by key. Errors name their lines.
#pragma once

#include <fmt/format.h>

#include <toml++/toml.h>
#include <initializer_list>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "cli/scene/scene.h"

namespace vps::cli {

/// Values that are not understood and keys that were not taken are a SceneError.
class Table {
 public:
  using Parser = double (*)(const std::string&);

  /// @param name  the table's name in messages
  Table(const toml::table& table, std::string file, std::string name)
      : table_(table), file_(std::move(file)), name_(std::move(name)) {}

  [[nodiscard]] Place place() const { return place_of(table_); }
  [[nodiscard]] Place place_of(const toml::node& node) const {
    return {file_, static_cast<int>(node.source().begin.line)};
  }
  [[noreturn]] void refuse(const toml::node& node, const std::string& reason) const {
    throw SceneError(place_of(node), reason);
  }

  /// Null when the key is absent.
  const toml::node* take(const char* key) {
    taken_.insert(key);
    return table_.get(key);
  }
  [[nodiscard]] bool has(const char* key) const { return table_.contains(key); }

  /// @param otherwise  when the key is absent
  std::string text(const char* key, const std::string& otherwise);
  // Each of the next four returns false and does nothing when the key is absent.
  bool quantity(const char* key, Parser parse, double& out);
  bool quantities(const char* key, Parser parse, Triple& out);
  bool number(const char* key, double low, double high, double& out);
  template <class Integer>
  bool integer(const char* key, std::int64_t low, std::int64_t high, Integer& out) {
    const toml::node* const node = take(key);
    if (node == nullptr) return false;
    const auto* const value = node->as_integer();
    if (value == nullptr || value->get() < low || value->get() > high)
      refuse(*node, fmt::format("{} is a whole number from {} to {}", key, low, high));
    out = static_cast<Integer>(value->get());
    return true;
  }
  template <class T>
  T choice(const char* key, std::initializer_list<std::pair<const char*, T>> choices, T otherwise) {
    const toml::node* const node = take(key);
    return node == nullptr ? otherwise : chosen(key, *node, choices);
  }
  template <class T>
  T chosen(const char* key, const toml::node& node, std::initializer_list<std::pair<const char*, T>> choices) const {
    const std::string text = text_of(key, node);
    std::string names;
    for (const auto& [name, value] : choices) {
      if (text == name) return value;
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", name);
    }
    refuse(node, fmt::format("{} is one of {}, not \"{}\"", key, names, text));
  }

  /// Refuses keys that are not among these.
  /// @param keys  the most usual first: of keys equally similar to a mistyped one, the first is suggested
  void allow_only(const std::vector<std::string>& keys) const;
  /// Refuses keys that were not taken: they have no meaning together with the other keys.
  void finish() const;

 private:
  [[nodiscard]] std::string text_of(const char* key, const toml::node& node) const;
  [[nodiscard]] double parsed(const char* key, const toml::node& node, Parser parse) const;

  const toml::table& table_;
  std::string file_, name_;
  std::set<std::string> taken_;
};

}  // namespace vps::cli
