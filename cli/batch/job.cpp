// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/job.h"

#include <algorithm>

#include "cli/terminal/bake_options.h"

namespace vps::cli::batch {
namespace {

std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? std::string() : option.get_lnames().front();
}

}  // namespace

std::vector<std::string> command_words(const OptionTexts& options) {
  std::vector<std::string> words;
  for (const auto& [name, text] : options) words.push_back("--" + name + "=" + text);
  return words;
}

BakeArguments bake_arguments(const Job& job) {
  BakeArguments arguments;
  CLI::App app;
  app.set_help_flag();
  add_bake_options(app, arguments);
  std::vector<std::string> words = command_words(job.options);
  std::reverse(words.begin(), words.end());  // CLI11 takes them from the back
  try {
    app.parse(std::move(words));
    require_bakeable(app, arguments);
  } catch (const CLI::ParseError& error) {
    throw BatchError(job.mesh.string(), error.what());
  }
  arguments.mesh = job.mesh.string();
  arguments.output = job.asset().string();
  return arguments;
}

const std::vector<std::string>& option_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = {"voxel", "unit", "scale", "fields", "parts"};
    BakeArguments arguments;
    CLI::App app;
    app.set_help_flag();
    add_bake_options(app, arguments);
    for (const CLI::Option* option : app.get_options()) {
      const std::string name = name_of(*option);
      if (!name.empty() && std::find(all.begin(), all.end(), name) == all.end()) all.push_back(name);
    }
    return all;
  }();
  return names;
}

std::string path_from(const std::filesystem::path& file, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path whole = fs::absolute(file).lexically_normal();
  const fs::path from = fs::weakly_canonical(fs::absolute(folder));
  return (fs::weakly_canonical(whole.parent_path()) / whole.filename()).lexically_proximate(from).generic_string();
}

OptionTexts given_options(const CLI::App& app) {
  OptionTexts given;
  const std::vector<std::string>& names = option_names();
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = name_of(*option);
    if (option->count() == 0 || std::find(names.begin(), names.end(), name) == names.end()) continue;
    given[name] = CLI::detail::join(option->results(), ",");
  }
  return given;
}

}  // namespace vps::cli::batch
