// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/terminal/suggest.h"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <vector>

#include "cli/terminal/command_tree.h"
#include "cli/tools/nearest_name.h"

namespace vps::cli {
namespace {

std::optional<std::string> nearest_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> names;
  for (const CLI::App* const one : commands_of(app)) names.push_back(one->get_name());
  return nearest_name(word, names);
}

std::string ending(const CLI::App& app, const std::optional<std::string>& meant) {
  return meant ? "; did you mean " + *meant + "?" : "; run " + full_name(app) + " --help";
}

}  // namespace

bool is_like_a_command(const CLI::App& app, const std::string& word) {
  return nearest_command(app, word).has_value();
}

std::string unknown_command(const CLI::App& app, const std::string& word) {
  if (word == "bake" && app.get_parent() == nullptr)
    return "there is no command 'bake'; a mesh alone is baked: vpsbake mesh.obj";
  return fmt::format("there is no command '{}'{}", word, ending(app, nearest_command(app, word)));
}

std::string unexpected_word(const CLI::App& app, const std::string& word) {
  if (!word.starts_with('-')) {
    if (!commands_of(app).empty() && app.get_parent() != nullptr) return unknown_command(app, word);
    return fmt::format("'{}' is not expected here{}", word, ending(app, std::nullopt));
  }
  std::vector<std::string> names;
  for (const OptionGroup& group : option_groups(app)) {
    for (const CLI::Option* const option : group.options) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
  }
  const std::string name = word.substr(0, word.find('='));
  return fmt::format("there is no option {}{}", name, ending(app, nearest_name(name, names)));
}

std::string one_dash(const CLI::App& app, std::span<char* const> words) {
  std::set<std::string> names;
  std::vector<const CLI::App*> apps = commands_of(app);
  apps.push_back(&app);
  for (const CLI::App* const one : apps) {
    for (const CLI::Option* const option : one->get_options()) {
      for (const std::string& name : option->get_lnames()) names.insert("-" + name);
    }
  }
  for (const std::string word : words) {
    if (word == "--") break;
    const std::string name = word.substr(0, word.find('='));
    if (names.contains(name)) return fmt::format("there is no option {0}; did you mean -{0}?", name);
  }
  return {};
}

std::string in_plain_words(const std::string& reason) {
  const std::string option = reason.substr(0, reason.find(':'));
  if (reason.starts_with(option + ": At Most 1 required")) return option + " is given twice; give it once";
  if (reason.starts_with(option + ": 1 required ") && reason.ends_with(" missing")) return option + " needs a value";
  return reason;
}

}  // namespace vps::cli
