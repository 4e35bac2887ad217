// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/batch/emit_script.h"

#include <fmt/format.h>

#include <filesystem>

#include "cli/terminal/units.h"
#include "cli/tools/provenance.h"

namespace vps::cli::batch {
namespace {

namespace fs = std::filesystem;

fs::path absolute(const std::string& path) {
  return fs::absolute(path).lexically_normal();
}

// The command vpsbake run, without the share.
std::string run_words(const ScriptOptions& options) {
  std::string line = "vpsbake run " + quoted_word(absolute(options.file).string());
  if (!options.cache.empty()) line += " --cache " + quoted_word(absolute(options.cache).string());
  if (!options.memory.empty()) line += " --memory " + quoted_word(options.memory);
  return line;
}

std::string merge_words(const ScriptOptions& options) {
  return "vpsbake merge " + quoted_word(absolute(options.file).string());
}

// Slurm's megabytes are 2^20 bytes.
std::string slurm_memory(const ScriptOptions& options) {
  if (options.memory.empty()) return "";
  return fmt::format("#SBATCH --mem={}M\n", (parse_size(options.memory) + (1 << 20) - 1) >> 20);
}

std::string slurm(const ScriptOptions& options) {
  return fmt::format(
      "#!/bin/sh\n"
      "# By vpsbake plan: an array of {0} tasks, each with its share of the bakes. Submit it again for what is\n"
      "# missing: what is done is left alone. Then: {1}\n"
      "#SBATCH --job-name=vpsbake\n"
      "#SBATCH --array=1-{0}\n"
      "{2}"
      "# Of the cores that the task has, not of the machine's.\n"
      "exec {3} --shard \"$SLURM_ARRAY_TASK_ID/{0}\" --jobs \"${{SLURM_CPUS_PER_TASK:-1}}\" --threads 1\n",
      options.tasks, merge_words(options), slurm_memory(options), run_words(options));
}

std::string parallel(const ScriptOptions& options) {
  return fmt::format(
      "#!/bin/sh\n"
      "# By vpsbake plan: GNU parallel over {0} shares of the bakes, then the manifest.\n"
      "# Options, such as --sshloginfile, are passed on.\n"
      "seq {0} | parallel \"$@\" {1} --shard '{{}}/{0}' --jobs 1 --threads 1\n"
      "exec {2}\n",
      options.tasks, quoted_word(run_words(options)), merge_words(options));
}

// One mark file per share, so that Snakemake resumes. The merge lists what is missing.
std::string snakemake(const ScriptOptions& options) {
  const auto braces_doubled = [](const std::string& text) {
    std::string out;
    for (const char c : text) out += c == '{' || c == '}' ? std::string(2, c) : c == '"' ? "\\\"" : std::string(1, c);
    return out;
  };
  return fmt::format(
      "# By vpsbake plan: {0} shares of the bakes, then the manifest.\n"
      "rule all:\n"
      "    input: expand(r\"{1}/{{share}}\", share=range(1, {0} + 1))\n"
      "    shell: \"{2}\"\n"
      "\n"
      "rule bake:\n"
      "    output: touch(r\"{1}/{{share}}\")\n"
      "    threads: 1\n"
      "    shell: \"{3} --shard {{wildcards.share}}/{0} --jobs {{threads}} --threads 1\"\n",
      options.tasks, absolute(options.file).string() + ".done", braces_doubled(merge_words(options)),
      braces_doubled(run_words(options)));
}

}  // namespace

std::string script_name(const ScriptOptions& options) {
  const char* const ending = options.engine == "slurm" ? ".sbatch" : options.engine == "snakemake" ? ".smk" : ".sh";
  return fs::path(options.file).replace_extension(ending).string();
}

std::string script_text(const ScriptOptions& options) {
  if (options.engine == "slurm") return slurm(options);
  return options.engine == "snakemake" ? snakemake(options) : parallel(options);
}

std::string script_beginning(const ScriptOptions& options) {
  return std::string(options.engine == "snakemake" ? "" : "#!/bin/sh\n") + "# By vpsbake plan: ";
}

std::string start_line(const ScriptOptions& options) {
  const std::string name = quoted_word(script_name(options));
  if (options.engine == "slurm") return fmt::format("sbatch {}, then {}", name, merge_words(options));
  return options.engine == "snakemake" ? fmt::format("snakemake --snakefile {} --cores 4", name)
                                       : fmt::format("sh {}", name);
}

}  // namespace vps::cli::batch
