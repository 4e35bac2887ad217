// SPDX-License-Identifier: GPL-3.0-or-later
// The command line: options to structs, one file per command.
#include <fcntl.h>
#include <malloc.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include "cli/batch/child_program.h"
#include "cli/commands/batch.h"
#include "cli/commands/commands.h"
#include "cli/terminal/bake_options.h"
#include "cli/terminal/command_tree.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/help_formatter.h"
#include "cli/terminal/options.h"
#include "cli/terminal/suggest.h"
#include "cli/tools/provenance.h"
#include "cli/tools/standard_streams.h"
#include "formats/mesh/child_process.h"

namespace vps::cli {
namespace {

void add_output_options(CLI::App& app, BakeArguments& arguments) {
  app.add_option("-o,--output", arguments.output,
                 "Asset to write; - is standard output [default: NAME.vps.hdf beside the mesh]")
      ->check(not_empty())
      ->option_text("FILE")
      ->group("Output");
  app.add_option("--depfile", arguments.depfile,
                 "Write there for make or ninja which files the asset depends on: the mesh and its buffers [default: "
                 "none]")
      ->check(not_stream())
      ->option_text("FILE")
      ->group("Output");
  app.add_flag("--json", arguments.json, "Print the result as JSON")->group("Output");
  add_verbosity_options(app, arguments.verbosity, "Print errors and warnings only",
                        "Print the plan and all that the asset holds, not one line");
  add_text_option(
      app, "--memory", [&](const std::string& text) { arguments.options.memory_limit_bytes = parse_size(text); },
      "Refuse to bake when more is needed, such as 4GB [default: 8GB]")
      ->option_text("SIZE")
      ->group("Output");
  add_integer(app, "--threads", arguments.threads, 1, 1024,
              "Processor cores to use, 1 to 1024; the output is identical for any number [default: all]")
      ->option_text("N")
      ->group("Output");
  app.add_flag("--dry-run", arguments.dry_run, "Read the mesh, say what would be baked, and write nothing")
      ->group("Output");
  add_text_option(
      app, "--dry-run-above", [&](const std::string& text) { arguments.dry_run_above = parse_size(text); },
      "The same if it would need more memory than this; for batches")
      ->option_text("SIZE")
      ->group("");
}

CLI::Option* set_version_flag(CLI::App& app) {
  return app.set_version_flag("-V,--version", version_text, "Print the versions of the program and of its libraries");
}

// The words of the command line in reverse order, as CLI11 takes them. CLI11 reads [a,b] as a list of two, so a file of
// this name gets ./ in front.
std::vector<std::string> command_line(int argc, char** argv) {
  std::vector<std::string> words;
  for (int i = argc - 1; i > 0; --i) {
    words.emplace_back(argv[i]);
    const bool is_value = i > 1 && argv[i - 1][0] == '-';
    if (words.back().starts_with('[') && words.back().ends_with(']') && !is_value) words.back().insert(0, "./");
  }
  return words;
}

int fail_usage(const std::string& reason) {
  return fail(kCommandLine, "command line", reason);
}

// A mesh has an extension, is there, or is standard input.
bool is_no_mesh(const std::string& word) {
  std::error_code ignored;
  return !word.empty() && !is_standard_stream(word) && !std::filesystem::path(word).has_extension() &&
         !std::filesystem::exists(word, ignored);
}

// @throw CLI::ParseError
void check_standard_streams(const BakeArguments& bake) {
  const bool from_input = is_standard_stream(bake.mesh);
  const bool to_output = is_standard_stream(bake.output) || (from_input && bake.output.empty());
  if (to_output && bake.json)
    throw CLI::ArgumentMismatch("--json and the asset both go to standard output; give the asset a file with -o");
  if ((from_input || to_output) && !bake.depfile.empty())
    throw CLI::ArgumentMismatch("--depfile needs a mesh and an output that are files, not -");
}

int program(int argc, char** argv);

// A bake in a child process, which gets --cache-size instead of the variable. Its last word is the mesh: `ps` shows it.
int child(int argc, char** argv) {
  prepare_children();
  ::unsetenv("VPSBAKE_CACHE_SIZE");
  ::prctl(PR_SET_NAME, std::filesystem::path(argv[argc - 1]).filename().c_str());
  return program(argc, argv);
}

int run(int argc, char** argv) {
  CLI::App app("Bakes triangle meshes into collision assets: signed distance voxelmaps and point-sphere trees.",
               "vpsbake");
  app.formatter(std::make_shared<HelpFormatter>());  // commands inherit it
  app.set_help_flag("-h,--help", "Print this help");
  set_version_flag(app);
  BakeArguments bake;
  app.add_option("MESH", bake.mesh, kMeshHelp);
  add_bake_options(app, bake);
  add_format_option(app, bake);
  add_output_options(app, bake);
  add_cache_options(app, bake.cache, bake.cache_bytes, "Output");
  std::vector<Command> commands = {add_batch_command(app),   add_plan_command(app),    add_run_command(app),
                                   add_merge_command(app),   add_explain_command(app), add_check_command(app),
                                   add_compare_command(app), add_export_command(app),  add_info_command(app),
                                   add_scene_command(app),   add_slice_command(app),   add_validate_command(app),
                                   add_view_command(app),    add_cache_command(app)};
  for (const Command& one : add_lab_commands(app)) commands.push_back(one);
  commands.push_back(add_help_command(app));
  commands.push_back(add_version_command(app));
  commands.push_back(add_help_files_command(app));
  app.footer(std::string("Example: vpsbake bunny.obj --voxel 0.5mm\nExit codes: ") + kExitCodes);
  for (const Command& one : commands) set_version_flag(*one.app)->group("");
  app.require_subcommand(0, 1);  // the words of help are names of commands
  const Command* command = nullptr;
  const std::span<char* const> words(argv + 1, static_cast<std::size_t>(std::max(argc - 1, 0)));
  if (const std::string reason = one_dash(app, words); !reason.empty()) return fail_usage(reason);

  try {
    app.parse(command_line(argc, argv));
    for (const Command& one : commands) {
      if (one.app->parsed()) command = &one;
    }
    if (command != nullptr) {
      for (const CLI::Option* option : app.get_options()) {
        if (option->count() == 0) continue;
        throw CLI::ArgumentMismatch(option->get_name() + " does not go before " + command->app->get_name());
      }
    } else {
      if (bake.mesh.empty()) throw CLI::RequiredError("a mesh");
      check_standard_streams(bake);
      if (is_no_mesh(bake.mesh) && is_like_a_command(app, bake.mesh))
        return fail_usage(unknown_command(app, bake.mesh));
      complete_bake_options(app, bake);
      read_cache_size(app, bake.cache_bytes);
    }
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    const CLI::App* named = &app;
    while (!named->get_subcommands().empty()) named = named->get_subcommands().front();
    std::vector<std::string> left = app.remaining(true);
    if (!left.empty() && left.front() == "--") {
      left.erase(left.begin());
      if (!left.empty() && left.front().starts_with('-'))
        return fail_usage("'" + left.front() + "' is after --, which ends the options; give options before it");
    }
    if (!left.empty()) {
      return fail_usage(is_no_mesh(bake.mesh) ? unknown_command(app, bake.mesh)
                                              : unexpected_word(*named, left.front()));
    }
    return fail_usage(in_plain_words(error.what()) + "; run " + full_name(*named) + " --help");
  }
  if (command == nullptr) return run_bake(bake);
  if (command->starts_programs) batch::prepare_programs(child);
  return command->run();
}

int program(int argc, char** argv) {
  remember_command(argc, argv);
  int code = 0;
  try {
    code = run(argc, argv);
  } catch (const std::system_error& error) {
    const bool closed = error.code() == std::errc::broken_pipe;
    return fail(
        kIo, "standard output",
        error.what() + std::string(closed ? "; the program that reads it has ended" : "; free space or redirect it"));
  }
  if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) {
    return fail(kIo, "standard output", "it cannot be written; free space or redirect it");
  }
  return code;
}

}  // namespace
}  // namespace vps::cli

int main(int argc, char** argv) {
#ifdef __GLIBC__
  // What one stage or one bake of a batch frees serves the next: pages that went back to the system cost faults.
  ::mallopt(M_MMAP_THRESHOLD, 1 << 21);
  ::mallopt(M_TRIM_THRESHOLD, 1 << 24);
#endif
  // Opens missing standard descriptors, so that no file opened later gets their numbers. Writing to standard output
  // then fails, as its reader is missing.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) < 0) ::open("/dev/null", (fd == STDOUT_FILENO ? O_RDONLY : O_RDWR) | O_CLOEXEC);
  }
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is a write error, not a crash
  return vps::cli::program(argc, argv);
}
