// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>

#include "cli/commands/batch.h"
#include "cli/terminal/bake_options.h"
#include "cli/terminal/complain.h"

namespace vps::cli {
namespace {

std::string name_of(const CLI::Option& option) {
  return option.get_lnames().empty() ? std::string() : option.get_lnames().front();
}

// The settings that these texts give on a command line.
bake::BakeSettings settings_of(const batch::OptionTexts& options) {
  BakeArguments arguments;
  CLI::App app;
  app.set_help_flag();
  add_bake_options(app, arguments);
  std::vector<std::string> words = batch::command_words(options);
  std::reverse(words.begin(), words.end());  // CLI11 takes words in reverse order
  try {
    app.parse(std::move(words));
    complete_bake_options(app, arguments);
  } catch (const CLI::ParseError& error) {
    throw UsageError(error.what());
  }
  return complete_settings(arguments);
}

// Common options come first: of names equally near to a mistyped one, the first is suggested.
std::vector<std::string> bake_option_names() {
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
}

}  // namespace

const batch::OptionReader& option_reader() {
  static const batch::OptionReader reader{bake_option_names(), settings_of};
  return reader;
}

batch::OptionTexts given_options(const CLI::App& app) {
  batch::OptionTexts given;
  const std::vector<std::string>& names = option_reader().names;
  for (const CLI::Option* option : app.get_options()) {
    const std::string name = name_of(*option);
    if (option->count() == 0 || std::find(names.begin(), names.end(), name) == names.end()) continue;
    given[name] = CLI::detail::join(option->results(), ",");
  }
  return given;
}

void note_idle(const batch::SettingsRead& read) {
  for (const auto& [file, glob] : read.idle)
    complain("note", file.string(), "no mesh matches '" + glob + "'; check the glob");
}

int guarded_batch(const std::function<int()>& work) {
  try {
    return work();
  } catch (const batch::BatchError& error) {
    return fail(error.code, error.file, error.what());
  } catch (const ImportError& error) {
    return fail(error.kind == ImportError::Kind::io ? kIo : kBadInput, "-", error.what());
  } catch (const CLI::ValidationError& error) {
    return fail(kCommandLine, "command line", error.what());
  } catch (const UsageError& error) {
    return fail(kCommandLine, "command line", error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(kIo, error.path1().string(), error.code().message() + "; check its name and rights");
  }
}

void add_input_options(CLI::App& app, batch::Inputs& inputs, BakeArguments& scratch) {
  app.add_option("DIR|MESH|LIST.toml...", inputs.paths,
                 "Folders of meshes, meshes, or lists of meshes that end in .toml")
      ->required();
  constexpr const char* kGroup = "Which meshes";
  app.add_option("--include", inputs.include,
                 "Only what one of these globs means, such as '*.obj' or 'parts/*'; a glob without a slash means names")
      ->allow_extra_args(false)
      ->option_text("GLOB")
      ->group(kGroup);
  app.add_option("--exclude", inputs.exclude, "Not what one of these globs means")
      ->allow_extra_args(false)
      ->option_text("GLOB")
      ->group(kGroup);
  add_bake_options(app, scratch);
}

}  // namespace vps::cli
