// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>

#include "cli/batch/emit_script.h"
#include "cli/batch/find_jobs.h"
#include "cli/batch/jobs_file.h"
#include "cli/commands/batch.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/terminal/write_output.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"
#include "cli/tools/utf8.h"

namespace vps::cli {
namespace {

using namespace batch;

struct PlanArguments {
  Inputs inputs;
  BakeArguments scratch;
  std::string folder;
  ScriptOptions script;
  std::size_t most_tasks = 1000;  // Slurm's default MaxArraySize is 1001
};

int run_plan(PlanArguments& arguments) {
  arguments.inputs.folder = arguments.folder;
  ScriptOptions& script = arguments.script;
  if (const std::string reason = output_refusal(script.file, "{\"mesh\"", "a file of jobs"); !reason.empty())
    return fail(kIo, script.file, reason);
  const std::string name = script.engine.empty() ? "" : script_name(script);
  if (!name.empty() && is_standard_stream(script.file))
    return fail(kCommandLine, "command line", "--emit needs a file of jobs; give its name with -o");
  if (name == script.file)
    return fail(kCommandLine, "command line", "the script would replace the jobs; name them jobs.jsonl");
  if (!name.empty()) {
    const std::string reason = output_refusal(name, script_beginning(script), "a script of vpsbake plan");
    if (!reason.empty()) return fail(kIo, name, reason);
  }
  for (const std::string& place : {script.file, script.cache}) {
    if (name.empty() || place.empty()) continue;
    if (std::filesystem::absolute(place).string().find_first_of("{}\n") != std::string::npos)
      return fail(kCommandLine, "command line", "names with braces or line breaks do not go into scripts; use others");
  }
  SettingsRead settings;
  std::vector<Job> jobs = find_jobs(arguments.inputs, option_reader(), &settings);
  note_idle(settings);
  refuse_unwritable(jobs);
  for (const Job& job : jobs) {
    if (!job.refusal.empty()) complain("warning", job.mesh.string(), job.refusal);
  }
  if (const int code = write_quietly(script.file, to_lines(jobs, script.file)); code != kOk) return code;
  print_lines(messages_beside(script.file), "{}: {} {}\n", one_line(script.file), jobs.size(),
              jobs.size() == 1 ? "job" : "jobs");
  if (script.engine.empty()) return kOk;
  script.tasks = std::min(jobs.size(), arguments.most_tasks);
  if (const int code = write_quietly(name, script_text(script)); code != kOk) return code;
  print_lines("{}: {} tasks; start it with: {}\n", name, script.tasks, start_line(script));
  return kOk;
}

}  // namespace

Command add_plan_command(CLI::App& app) {
  CLI::App* const plan =
      app.add_subcommand("plan", "Write the bakes of folders as lines of a file, for other machines");
  const auto arguments = std::make_shared<PlanArguments>();
  PlanArguments& a = *arguments;
  add_input_options(*plan, a.inputs, a.scratch);
  plan->add_option("-o,--output", a.script.file, "File of jobs to write, such as jobs.jsonl; - is standard output")
      ->required()
      ->check(not_empty())
      ->option_text("JOBS.jsonl")
      ->group("Output");
  plan->add_option("--into", a.folder, "Folder of the assets that the jobs will write")
      ->required()
      ->check(not_stream())
      ->option_text("DIR")
      ->group("Output");
  constexpr const char* kGroup = "Script";
  auto* const emit =
      plan->add_option("--emit", a.script.engine, "Write a script as well: slurm, snakemake or parallel");
  emit->check(CLI::IsMember({"slurm", "snakemake", "parallel"}))->option_text("ENGINE")->group(kGroup);
  add_integer(*plan, "--tasks", a.most_tasks, 1, 99999999,
              "Tasks at most, 1 to 99999999, each with a share of the jobs [default: 1000]")
      ->needs(emit)
      ->option_text("N")
      ->group(kGroup);
  if (const char* const folder = std::getenv("VPSBAKE_CACHE")) a.script.cache = folder;  // options override it
  plan->add_option("--cache", a.script.cache,
                   "Folder of the cache that all tasks share [default: the environment's VPSBAKE_CACHE, or none]")
      ->needs(emit)
      ->check(not_stream())
      ->option_text("DIR")
      ->group(kGroup);
  add_text_option(
      *plan, "--task-memory",
      [&a](const std::string& text) {
        (void)parse_size(text);
        a.script.memory = text;
      },
      "Memory of a task, such as 4GB [default: the engine's]")
      ->needs(emit)
      ->option_text("SIZE")
      ->group(kGroup);
  plan->footer(
      "Example: vpsbake plan meshes -o jobs.jsonl --into assets --voxel 5mm --emit slurm --cache /shared/vpsbake");
  return {plan, [arguments, plan] {
            arguments->inputs.options = given_options(*plan);
            return guarded_batch([&] { return run_plan(*arguments); });
          }};
}

}  // namespace vps::cli
