// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <filesystem>
#include <memory>
#include <span>

#include "cli/terminal/command_tree.h"
#include "cli/terminal/completion.h"
#include "cli/terminal/man_page.h"
#include "formats/hdf5/hdf5_writer.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;

void write_text(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  write_whole(file, std::as_bytes(std::span(text)));
}

void write_pages(const fs::path& folder, const CLI::App& app) {
  write_text(folder / (page_name(app) + ".1"), man_page(app));
  for (const CLI::App* const one : commands_of(app)) write_pages(folder, *one);
}

}  // namespace

Command add_help_files_command(CLI::App& app) {
  CLI::App* const files = app.add_subcommand("help-files", "Write manual pages and completions for bash and zsh");
  files->group("");
  const auto folder = std::make_shared<std::string>();
  files->add_option("--into", *folder, "Folder, laid out like share/ of an installation")
      ->required()
      ->check(not_empty())
      ->option_text("DIR");
  return {files, [folder, &app] {
            return guarded(*folder, [&] {
              write_pages(fs::path(*folder) / "man/man1", app);
              write_text(fs::path(*folder) / "bash-completion/completions/vpsbake", bash_completion(app));
              write_text(fs::path(*folder) / "zsh/site-functions/_vpsbake", zsh_completion(app));
              return 0;
            });
          }};
}

}  // namespace vps::cli
