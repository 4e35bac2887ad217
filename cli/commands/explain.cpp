// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/commands/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/batch/find_jobs.h"
#include "cli/batch/reasons.h"
#include "cli/batch/report.h"
#include "cli/commands/batch.h"
#include "cli/commands/open_asset.h"
#include "cli/terminal/complain.h"
#include "cli/terminal/print.h"
#include "cli/tools/output_file.h"
#include "cli/tools/standard_streams.h"

namespace vps::cli {
namespace {

namespace fs = std::filesystem;
using namespace batch;
using Json = nlohmann::ordered_json;

// What the last batch did with an asset or a mesh.
struct LastRun {
  fs::path log;
  fs::path from;  // where it ran
  Inputs asked;
  Json item;
};

// Finds the log of a batch that names the file, in this folder or one above it.
std::optional<LastRun> last_run(const fs::path& file, const fs::path& from_folder) {
  std::error_code failed;
  for (fs::path folder = fs::weakly_canonical(from_folder, failed);; folder = folder.parent_path()) {
    std::ifstream in(folder / kLog);
    const Json log = in ? Json::parse(in, nullptr, false) : Json();
    try {
      if (log.is_object()) {
        const fs::path from = log.at("cwd").get<std::string>();
        for (const Json& item : log.at("items")) {
          const bool meant = is_same_place(from / item.at("asset").get<std::string>(), file) ||
                             is_same_place(from / item.at("mesh").get<std::string>(), file);
          if (meant) return LastRun{folder / kLog, from, inputs_from(log.at("asked")), item};
        }
      }
    } catch (const Json::exception&) {
      // not a log of this version
    }
    if (folder == folder.root_path()) return std::nullopt;
  }
}

void explain_last(const LastRun& last) {
  print_lines("last batch: {}\n", last.item.at("state").get<std::string>());
  for (const Json& reason : last.item.at("reasons")) print_lines("  {}\n", reason.get<std::string>());
  if (last.item.contains("error")) print_lines("  {}\n", last.item["error"].get<std::string>());
  if (last.item.at("state") == describe(JobResult::State::unchanged))
    print_lines("  the mesh's bytes, every setting and the program were the same\n");
}

// Whether the same batch would bake the file now: the same options, and vpsbake.toml as it is now.
void explain_now(const LastRun& last) {
  fs::current_path(last.from);
  const std::string asset = last.item.at("asset");
  const std::vector<Job> jobs = find_jobs(last.asked, option_reader());
  const auto job =
      std::find_if(jobs.begin(), jobs.end(), [&](const Job& one) { return one.asset().string() == asset; });
  if (job == jobs.end()) {
    print_lines("now: the same batch would not bake it\n");
    return;
  }
  const Standing now = job->refusal.empty() ? compare_with_asset(*job) : Standing{{}, {job->refusal}};
  if (now.wanted && known_failures(last.log).contains(bake::cache_key(*now.wanted).digits)) {
    print_lines("now: the same batch would not try it again, as its mesh, its settings and the program are the same\n");
    return;
  }
  print_lines("now: {}\n", now.reasons.empty()     ? "up to date"
                           : !job->refusal.empty() ? "the same batch would refuse it"
                                                   : "the same batch would bake it again");
  for (const std::string& reason : now.reasons) print_lines("  {}\n", reason);
}

int explain(const std::string& file, const std::string& folder) {
  std::optional<LastRun> last;
  if (!is_standard_stream(file))
    last = last_run(file, folder.empty() ? fs::absolute(file).parent_path() : fs::path(folder));
  if (last) {
    explain_last(*last);
    explain_now(*last);
    return kOk;
  }
  if (has_mesh_extension(file))
    return fail(kBadInput, file, "no batch that baked it is known here; give the folder of its assets with -o");
  Asset asset;
  if (const int code = open_asset(file, asset); code != kOk) return code;
  const bake::BakeRecord record = bake::record_of(asset);
  if (record.text.empty()) return fail(kBadInput, file, "it does not say what it was baked from; bake it again");
  print_lines("{}it was baked with\n", is_standard_stream(file) ? "" : "no batch in its folder bakes it; ");
  for (const std::string& setting : readable_settings(record)) print_lines("  {}\n", setting);
  return kOk;
}

CLI::Validator existing_folder() {
  return {[](std::string& name) { return fs::is_directory(name) ? std::string() : "there is no folder " + name; }, ""};
}

}  // namespace

Command add_explain_command(CLI::App& app) {
  CLI::App* const command =
      app.add_subcommand("explain", "Say why a batch baked an asset or did not, and whether it would now");
  struct ExplainArguments {
    std::string file, folder;
  };
  const auto a = std::make_shared<ExplainArguments>();
  command->add_option("FILE", a->file, "Asset of a batch, its mesh (with -o), or any asset")->required();
  command->add_option("-o,--output", a->folder, "Folder of the batch's assets [default: that of the file]")
      ->check(existing_folder())
      ->option_text("DIR");
  command->footer("Example: vpsbake explain assets/gear.vps.hdf");
  return {command, [a] {
            try {
              return explain(a->file, a->folder);
            } catch (const BatchError& error) {
              return fail(error.code, error.file, error.what());
            } catch (const fs::filesystem_error& error) {
              return fail(kIo, error.path1().string(), error.code().message() + "; run the batch again");
            } catch (const Json::exception&) {
              return fail(kBadInput, a->file, "the log of its last batch is damaged; run the batch again");
            }
          }};
}

}  // namespace vps::cli
